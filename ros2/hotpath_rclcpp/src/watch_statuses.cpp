// SPDX-License-Identifier: Apache-2.0
#include "watch_statuses.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

namespace hotpath {

namespace {

using nlohmann::json;
using Level = WatchStatus::Level;

/// Counts of the watcher itself that should be zero.
constexpr std::array kLosses = {"dropped", "damaged", "late", "ignored_entities"};

std::string text_of(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_null()) return "unknown";
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

void add(WatchStatus& status, const std::string& key, const json& value) {
  status.values.push_back({key, text_of(value)});
}

/// Worse levels have larger numbers, but stale says less than warn and error do.
int weight(Level level) { return level == Level::stale ? 0 : 1 + static_cast<int>(level); }

/// Takes over a worse level with its message.
void raise(WatchStatus& status, Level level, const std::string& message) {
  if (weight(level) <= weight(status.level)) return;
  status.message = message;
  status.level = level;
}

using Counts = std::map<std::string, std::uint64_t>;

/// By how much a count has grown since the previous line.
std::uint64_t growth(Counts& counts, const std::string& name, std::uint64_t count) {
  const std::uint64_t before = std::exchange(counts[name], count);
  return count > before ? count - before : 0;
}

WatchStatus watcher_status(const json& report, Counts& counts) {
  WatchStatus status{Level::ok, "hotpath watch", "watching", {}};
  for (const char* const key : {"time_s", "processes", "threads", "events"}) add(status, key, report.at(key));
  for (const char* const key : kLosses) {
    add(status, key, report.at(key));
    const auto count = report.at(key).get<std::uint64_t>();
    if (growth(counts, key, count) > 0) raise(status, Level::warn, std::string("events were lost: ") + key);
  }
  if (report.at("threads") == 0) {
    raise(status, Level::warn, "no tracepoint was recorded");
  }
  return status;
}

WatchStatus callback_status(const json& callback) {
  WatchStatus status{Level::ok, "hotpath watch: " + callback.at("name").get<std::string>(), "", {}};
  for (const char* const key : {"rate", "jobs", "lost"}) add(status, key, callback.at(key));
  for (const char* const key : {"execution_ms", "response_ms"}) {
    const json& value = callback.at(key);
    if (!value.is_object()) continue;
    for (const auto& [statistic, number] : value.items())
      add(status, std::string(key) + " " + statistic, number);
  }
  std::array<char, 32> rate{};
  std::snprintf(rate.data(), rate.size(), "%.1f jobs/s", callback.at("rate").get<double>());
  status.message = rate.data();
  return status;
}

/// What a term is about. A callback is called by its name alone.
std::string subject_of(const json& term) {
  if (term.contains("callback")) return term.at("callback");
  for (const char* const kind : {"chain", "thread", "topic"})
    if (term.contains(kind)) return std::string(kind) + " " + term.at(kind).get<std::string>();
  throw NoReport("a term of the contract names no callback");
}

/// Level of a term with this verdict, and its message.
std::pair<Level, std::string> judge(const json& term, bool broken_now) {
  const std::string verdict = term.at("verdict"), reason = text_of(term.at("reason"));
  const std::string name = text_of(term.at("term"));
  if (verdict == "held") return {Level::ok, "held"};
  if (verdict == "broken" && broken_now) return {Level::error, name + " broken: " + reason};
  if (verdict == "broken") return {Level::warn, name + " was broken: " + reason};
  const bool lost = term.at("checked").get<std::uint64_t>() > 0;
  return {lost ? Level::warn : Level::stale, name + " not observable: " + reason};
}

void add_contract(std::vector<WatchStatus>& statuses, const json& contract, Counts& counts) {
  std::map<std::string, std::size_t> places;
  for (const json& term : contract.at("terms")) {
    const std::string subject = subject_of(term), name = text_of(term.at("term"));
    const auto [place, is_new] = places.emplace(subject, statuses.size());
    if (is_new) statuses.push_back({Level::stale, "hotpath contract: " + subject, "", {}});
    WatchStatus& status = statuses[place->second];
    const auto broken = growth(counts, std::string(subject).append("\n").append(name), term.at("broken"));
    const auto [level, message] = judge(term, broken > 0);
    if (status.message.empty()) status.message = message;
    raise(status, level, message);
    if (!term.at("limit").is_null()) add(status, name, term.at("limit"));
    add(status, name + " verdict", term.at("verdict"));
    add(status, name + " broken", term.at("broken"));
  }
}

/// Monitors identify a status by its name: numbers those that repeat.
void make_unique(std::vector<WatchStatus>& statuses) {
  std::map<std::string, int> uses;
  for (WatchStatus& status : statuses) {
    const int use = ++uses[status.name];
    if (use > 1) status.name += " #" + std::to_string(use);
  }
}

}  // namespace

std::vector<WatchStatus> WatchStatuses::of(const std::string& line) {
  std::vector<WatchStatus> statuses;
  try {
    const json report = json::parse(line);
    if (report.contains("event")) {  // between two reports
      incident_ = WatchStatus{Level::error, "hotpath watch: incident", report.at("incident"), {}};
      add(*incident_, "number", report.at("number"));
      const WatchStatus now = *incident_;
      incident_->level = Level::warn;
      return {now};
    }
    statuses.push_back(watcher_status(report, counts_));
    for (const json& callback : report.at("callbacks")) statuses.push_back(callback_status(callback));
    if (const auto contract = report.find("contract"); contract != report.end()) {
      add_contract(statuses, *contract, counts_);
    }
    if (incident_) statuses.push_back(*incident_);
  } catch (const json::exception& error) {
    throw NoReport(error.what());
  }
  make_unique(statuses);
  latest_ = statuses;
  return statuses;
}

std::vector<WatchStatus> WatchStatuses::stale(const std::string& reason) const {
  std::vector<WatchStatus> statuses = latest_;
  if (statuses.empty()) statuses.push_back({Level::stale, "hotpath watch", "", {}});
  for (WatchStatus& status : statuses) {
    status.level = Level::stale;
    status.message = reason;
  }
  return statuses;
}

}  // namespace hotpath
