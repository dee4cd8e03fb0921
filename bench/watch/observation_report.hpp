// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "import/recorded_graph.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "watch/observer.hpp"
#include "watch/session.hpp"

namespace hotpath::watch {

/// The state of a watched system at one instant, for people and for programs.
class ObservationReport {
 public:
  /// `whole`: rates are those since the beginning, of threads since they were first seen.
  explicit ObservationReport(bool whole) : whole_(whole) {}

  /// Facts for the next update. Those of threads that have just ended stay, because their process may be
  /// about to end; when all have ended, the last ones stay.
  void follow(const ThreadReading& reading, const Observer& observer) {
    if (reading.facts.empty()) return;
    read_ = reading.at;
    for (const ThreadFacts& facts : reading.facts) {
      const FollowedThread first{facts, facts, read_, read_, facts.policy};
      FollowedThread& thread = followed_.try_emplace({facts.key(), facts.started}, first).first->second;
      thread.facts = facts;
      thread.at = read_;
      name_executor(thread, observer);
    }
    std::erase_if(followed_, [&](const auto& thread) { return thread.second.at + kEnding < read_; });
  }
  /// `now`: since the beginning. Rates of less than half a second since those before are not shown: the
  /// previous ones stay.
  void update(const Observer& observer, const Session& session, Duration now) {
    const Losses losses = session.losses();
    const tracing::System& system = observer.system();
    json_ = {{"time_s", to_s(now)},
             {"processes", system.processes.size() + system.ended_processes},
             {"threads", session.threads()},
             {"events", observer.events()},
             {"dropped", losses.dropped},
             {"damaged", losses.damaged},
             {"late", losses.late},
             {"ignored_entities", system.ignored},
             {"callbacks", callbacks(observer, now)},
             {"chains", chains(observer)},
             {"executor_threads", threads(observer)}};
  }

  /// Callbacks that ran or lost samples, then chains of the contract and threads, if there are any.
  [[nodiscard]] std::vector<program::Table> tables() const {
    std::string title = program::concat(program::fixed(json_["time_s"], 0), " s: ", json_["processes"],
                                        " processes with nodes, ", json_["threads"], " threads, ",
                                        json_["events"], " events");
    for (const char* lost : {"dropped", "damaged", "late", "ignored_entities"})
      if (const std::string meaning = lost; json_[lost] > 0)
        title += program::concat(", ", json_[lost], " ", meaning.substr(0, meaning.find('_')));
    std::vector<nlohmann::json> callbacks = json_["callbacks"];
    std::erase_if(callbacks, [](const nlohmann::json& callback) {
      return imports::is_housekeeping(callback.value("topic", ""));  // every node has it
    });
    std::vector<program::Table> tables = {
        program::table_of<nlohmann::json>({{"callback", "/name"},
                                           {"jobs/s", "/rate", "%.1f"},
                                           {"jobs", "/jobs"},
                                           {"lost", "/lost"},
                                           {"execution\np99 ms", "/execution_ms/p99", "%.3f"},
                                           {"execution\nmax ms", "/execution_ms/max", "%.3f"},
                                           {"response\np99 ms", "/response_ms/p99", "%.3f"},
                                           {"response\nmax ms", "/response_ms/max", "%.3f"}},
                                          callbacks, title)};
    if (!json_["chains"].empty())
      tables.push_back(program::table_of<nlohmann::json>({{"chain", "/chain"},
                                                          {"outputs", "/outputs"},
                                                          {"hot path\np99 ms", "/hot_path_ms/p99", "%.3f"},
                                                          {"hot path\nmax ms", "/hot_path_ms/max", "%.3f"},
                                                          {"age\np99 ms", "/age_ms/p99", "%.3f"},
                                                          {"age\nmax ms", "/age_ms/max", "%.3f"}},
                                                         json_["chains"], "Chains"));
    if (!json_["executor_threads"].empty())
      tables.push_back(program::table_of<nlohmann::json>(
          {{"process", "/process"},
           {"thread", "/thread"},
           {"name", "/name"},
           {"executor", "/executor"},
           {"policy", "/policy"},
           {"before", "/policy_before"},
           {"processors", [](const nlohmann::json& row) { return program::joined(row["processors"], ","); }},
           {"CPU\nms/s", "/cpu_ms_per_s", "%.1f"},
           {"waited\nms/s", "/waited_ms_per_s", "%.1f"},
           {"withheld\nms/s", "/withheld_ms_per_s", "%.1f"}},
          json_["executor_threads"], "Threads"));
    return tables;
  }
  [[nodiscard]] const nlohmann::json& json() const { return json_; }

 private:
  /// Time over which a rate is shown.
  static constexpr Duration kShortest = std::chrono::milliseconds(500);
  /// For which the threads of a process may end one after another.
  static constexpr Duration kEnding = std::chrono::seconds(1);

  struct FollowedThread {
    ThreadFacts facts, before;  ///< The latest ones, and those from which its rates count.
    Time at{}, before_at{};     ///< Of both.
    ThreadPolicy first_policy = {};
    std::string executor = {};
    nlohmann::json rates = {{"cpu_ms_per_s", 0.0}, {"waited_ms_per_s", 0.0}, {"withheld_ms_per_s", 0.0}};
  };

  static void name_executor(FollowedThread& thread, const Observer& observer) {
    if (thread.executor.empty()) thread.executor = observer.executor_of(thread.facts.key());
  }
  static nlohmann::json stored_ms(const program::LatencyHistogram& observed) {
    if (observed.max() < Duration::zero()) return nullptr;
    return {{"p99", to_ms(observed.quantile(0.99))}, {"max", to_ms(observed.max())}};
  }

  [[nodiscard]] nlohmann::json callbacks(const Observer& observer, Duration now) {
    const double seconds = to_s(now - rated_at_);
    const bool rates = seconds > 0 && (rated_at_ == Duration::zero() || now - rated_at_ >= kShortest);
    if (rates && !whole_) rated_at_ = now;
    rates_.resize(observer.callbacks().size());
    nlohmann::json rows = nlohmann::json::array();
    for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
      const CallbackObservation& observed = observer.callbacks()[c];
      const std::uint64_t jobs = observed.execution.count();
      if (jobs + observed.lost == 0) continue;
      auto& [before, rate] = rates_[c];
      if (rates) rate = static_cast<double>(jobs - before) / seconds;
      if (rates && !whole_) before = jobs;
      nlohmann::json& row = rows.emplace_back(named(observer.system(), observer.system().callbacks[c]));
      row.update({{"rate", rate},
                  {"jobs", jobs},
                  {"lost", observed.lost},
                  {"execution_ms", stored_ms(observed.execution)},
                  {"response_ms", stored_ms(observed.response)}});
    }
    return rows;
  }
  /// The fields that name a callback.
  static nlohmann::json named(const tracing::System& system, const tracing::Callback& callback) {
    constexpr const char* kKinds[] = {"timer", "subscription", "service"};
    const auto kind = static_cast<std::size_t>(callback.kind);
    const bool timer = callback.kind == tracing::CallbackKind::timer, known = kind < std::size(kKinds);
    const bool service = callback.kind == tracing::CallbackKind::service;
    nlohmann::json fields = {{"name", callback_name(system, callback)},
                             {"node", node_name(system, callback.node)},
                             {"kind", known ? kKinds[kind] : "unknown"}};
    if (timer) fields["period_ms"] = to_ms(callback.period);
    if (!timer && known && callback.topic < system.topics.size())
      fields[service ? "service" : "topic"] = system.topics[callback.topic].name;
    return fields;
  }
  static nlohmann::json chains(const Observer& observer) {
    nlohmann::json rows = nlohmann::json::array();
    for (std::uint32_t c = 0; c < observer.chains().size(); ++c) {
      const ObservedChain& observed = observer.chains()[c];
      rows.push_back({{"chain", observer.contract().chains[c].name},
                      {"outputs", observed.hot_path.count()},
                      {"hot_path_ms", stored_ms(observed.hot_path)},
                      {"age_ms", stored_ms(observed.age)}});
    }
    return rows;
  }
  [[nodiscard]] nlohmann::json threads(const Observer& observer) {
    nlohmann::json rows = nlohmann::json::array();
    for (auto& [identity, thread] : followed_) {
      const ThreadFacts& of = thread.facts;
      rate(thread);
      name_executor(thread, observer);
      const bool changed = thread.first_policy != of.policy;
      rows.push_back({{"process", of.process},
                      {"thread", of.thread},
                      {"name", of.name},
                      {"executor", thread.executor},
                      {"policy", to_string(of.policy) + (of.inherited ? " (inherited)" : "")},
                      {"policy_before", changed ? nlohmann::json(to_string(thread.first_policy)) : nullptr},
                      {"processors", of.processors}});
      rows.back().update(thread.rates);
    }
    return rows;
  }
  void rate(FollowedThread& thread) const {
    const ThreadFacts &now = thread.facts, &before = thread.before;
    if (read_ - thread.before_at < kShortest) return;
    const double seconds = to_s(read_ - thread.before_at);
    const bool stayed = now.processor == before.processor;  // each one has a counter of its own
    thread.rates = {{"cpu_ms_per_s", to_ms(now.ran - before.ran) / seconds},
                    {"waited_ms_per_s", to_ms(now.waited - before.waited) / seconds},
                    {"withheld_ms_per_s", stayed ? to_ms(now.stolen - before.stolen) / seconds : 0}};
    if (whole_) return;
    thread.before = now;
    thread.before_at = read_;
  }

  const bool whole_;
  nlohmann::json json_;
  std::map<std::pair<ThreadKey, std::uint64_t>, FollowedThread> followed_;  // also by ThreadFacts::started
  Time read_{};
  std::vector<std::pair<std::uint64_t, double>> rates_;  // by callback: its jobs before, and their rate since
  Duration rated_at_{};
};

}  // namespace hotpath::watch
