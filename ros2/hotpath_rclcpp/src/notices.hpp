// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "schedule.hpp"

namespace hotpath {

/// What the log says about one executor: one line once its order has settled, and warnings with their
/// remedies. A warning names its callbacks, and no callback twice. The driver's lock serialises all
/// calls.
class Notices {
 public:
  struct Lines {
    std::string info;                ///< Empty: nothing to say.
    std::vector<std::string> order;  ///< All callbacks, if the order changed.
    std::vector<std::string> warnings;
  };

  /// A callback joined or (`learnt`) an edge was learnt. The order has settled when no edge was
  /// learnt for two seconds, or for twice `longest_period`.
  void order_changed(Time now, Duration longest_period, bool learnt);
  /// A sample arrived that no callback of this executor published during its call.
  void came_from_outside(const std::shared_ptr<Entry>& entry, Time now, Duration longest_period);
  /// A job waited for `wait` before it started, or has waited so long without starting.
  void waited(const std::shared_ptr<Entry>& entry, Duration wait, Duration period, Time now);

  /// Waits count from now on: no thread ran callbacks before.
  void begin(Time now) { since_ = now; }

  /// When due() becomes true without another call. Only work makes a scan worthwhile.
  [[nodiscard]] Time next() const { return std::min(settles_, late_at_); }
  [[nodiscard]] bool due(Time now) const { return now >= settles_ || now >= late_at_ || now >= scan_at_; }
  /// What is to be logged now.
  [[nodiscard]] Lines take(Time now, Schedule& schedule);
  /// Warnings about the options, which need no callback to run.
  [[nodiscard]] std::vector<std::string> of_options(const Schedule& schedule);

 private:
  struct Late {
    std::string id;
    Duration wait{}, period{};
  };
  [[nodiscard]] std::string settled(const Schedule& schedule);
  [[nodiscard]] std::string of_outside(const Schedule& schedule);
  [[nodiscard]] std::string of_late();

  Time since_{}, settles_ = kNever, late_at_ = kNever;
  Time scan_at_{};  ///< When to look for jobs that wait and do not start.
  bool introduced_ = false;
  std::vector<std::weak_ptr<Entry>> from_outside_;
  std::vector<Late> late_;
  std::set<std::string> said_;
};

}  // namespace hotpath
