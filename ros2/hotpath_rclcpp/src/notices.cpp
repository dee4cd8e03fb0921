// SPDX-License-Identifier: Apache-2.0
#include "notices.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

namespace {

constexpr Duration kLeastLearning = std::chrono::seconds(2);
constexpr Duration kScanInterval = std::chrono::seconds(1);
/// Late callbacks of this long share one warning.
constexpr Duration kCollect = std::chrono::seconds(1);
constexpr int kManyPeriods = 10;
constexpr std::size_t kNamed = 10;  ///< Callbacks that one line names.

/// Topics of every node; their callbacks belong to no chain.
constexpr std::array<std::string_view, 3> kInfrastructure = {"/parameter_events", "/rosout", "/clock"};

std::string listed(const std::vector<std::string>& names) {
  std::string text = joined(std::span(names).first(std::min(names.size(), kNamed)), ", ");
  if (names.size() > kNamed) text += " and " + std::to_string(names.size() - kNamed) + " more";
  return text;
}

std::string in_ms(Duration duration) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.4g ms", static_cast<double>(duration.count()) / 1e6);
  return text.data();
}

}  // namespace

void Notices::order_changed(Time now, Duration longest_period, bool learnt) {
  if (learnt || settles_ == kNever) settles_ = now + std::max(kLeastLearning, 2 * longest_period);
}

void Notices::came_from_outside(const std::shared_ptr<Entry>& entry, Time now, Duration longest_period) {
  if (std::exchange(entry->from_outside, true)) return;
  from_outside_.push_back(entry);
  order_changed(now, longest_period, false);
}

void Notices::waited(const std::shared_ptr<Entry>& entry, Duration wait, Duration period, Time now) {
  wait = std::min(wait, now - since_);
  if (period <= Duration::zero() || wait / kManyPeriods <= period) return;
  if (std::exchange(entry->waited_long, true)) return;
  late_.push_back({entry->id, wait, period});
  late_at_ = std::min(late_at_, now + kCollect);
}

Notices::Lines Notices::take(Time now, Schedule& schedule) {
  Lines lines;
  if (now >= scan_at_) {
    scan_at_ = now + kScanInterval;
    schedule.for_each_waiting(now, [&](const std::shared_ptr<Entry>& entry, Duration wait) {
      waited(entry, wait, schedule.period_of(entry->number), now);
    });
  }
  const auto warn = [&](std::string text) {
    if (!text.empty()) lines.warnings.push_back(std::move(text));
  };
  if (now >= settles_) {
    settles_ = kNever;
    if (rcutils_logging_logger_is_enabled_for("hotpath_rclcpp", RCUTILS_LOG_SEVERITY_DEBUG))
      lines.order = schedule.order();
    if (!std::exchange(introduced_, true)) lines.info = settled(schedule);
    lines.warnings = of_options(schedule);
    warn(of_outside(schedule));
  }
  if (now >= late_at_) {
    late_at_ = kNever;
    warn(of_late());
  }
  return lines;
}

std::string Notices::settled(const Schedule& schedule) {
  std::vector<std::string> order = schedule.order();
  const std::size_t callbacks = order.size();
  std::erase_if(order, [](const std::string& text) { return text.ends_with(": last"); });
  if (order.size() > kNamed) order.resize(kNamed);
  return "Executor " + schedule.setup().name + " serves " + std::to_string(callbacks) +
         " callbacks. Most urgent: " + (order.empty() ? "none has a priority" : listed(order)) +
         ". For all: priority_order(), or log level DEBUG of logger hotpath_rclcpp.";
}

std::vector<std::string> Notices::of_options(const Schedule& schedule) {
  std::vector<std::string> warnings = schedule.unmatched();
  if (schedule.lacks_priorities()) {
    warnings.push_back("Executor " + schedule.setup().name +
                       " has no priorities: all callbacks are equally urgent, and some may wait for seconds. "
                       "Give it the option `priorities` or a `graph` with priorities, call "
                       "set_priority(), or use rm-ro.");
  }
  std::erase_if(warnings, [&](const std::string& text) { return !said_.insert(text).second; });
  return warnings;
}

std::string Notices::of_outside(const Schedule& schedule) {
  std::vector<std::string> names;
  for (const std::weak_ptr<Entry>& weak : from_outside_) {
    const std::shared_ptr<Entry> entry = weak.lock();
    if (!entry || std::ranges::count(kInfrastructure, entry->topic) > 0) continue;
    if (schedule.runs_last(*entry)) names.push_back(entry->id);
  }
  from_outside_.clear();
  if (names.empty()) return "";
  const std::string graph = schedule.setup().graph.nodes.empty()
                                ? "Give each process the graph of the whole system"
                                : "Graph " + schedule.setup().graph.name +
                                      " does not have them: give each process the graph of the whole system";
  return "These inputs run last, because their samples come from another process, executor or asynchronous "
         "publisher, so that their origin cannot be learnt: " +
         listed(names) + ". " + graph +
         " by the option `graph`; `hotpath import` and `hotpath advise` write it from a trace.";
}

std::string Notices::of_late() {
  std::vector<std::string> names;
  for (const Late& late : late_) {
    names.push_back(late.id + " (" + in_ms(late.wait) + ", period " + in_ms(late.period) + ")");
  }
  late_.clear();
  if (names.empty()) return "";
  return "These callbacks waited for more than ten of their periods: " + listed(names) +
         ". The executor has more work than time, or more urgent callbacks take its time: shorten them, "
         "lower their rate, or move callbacks to another executor; `hotpath advise` compares the choices.";
}

}  // namespace hotpath
