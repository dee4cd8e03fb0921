// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "program/table.hpp"
#include "watch/observer.hpp"

namespace hotpath::watch {

/// The state of a watched system at one instant, for people and for programs.
class ObservationReport {
 public:
  /// `whole`: rates are those since the beginning, of threads since they were first seen.
  explicit ObservationReport(bool whole) : whole_(whole) {}

  /// Facts for the next update. Those of threads that have just ended stay, because their process may be
  /// about to end; when all have ended, the last ones stay.
  void follow(const ThreadReading& reading, const Observer& observer);
  /// `now`: since the beginning. Rates of less than half a second since those before are not shown: the
  /// previous ones stay.
  void update(const Observer& observer, const Session& session, Duration now);

  /// Callbacks that ran or lost samples, then chains of the contract and threads, if there are any.
  [[nodiscard]] std::vector<program::Table> tables() const;
  [[nodiscard]] const nlohmann::json& json() const { return json_; }

 private:
  struct FollowedThread {
    ThreadFacts facts, before;  ///< The latest ones, and those from which its rates count.
    Time at{}, before_at{};     ///< Of both.
    ThreadPolicy first_policy = {};
    std::string executor = {};
    double ran = 0, waited = 0, withheld = 0;  ///< ms in a second.
  };
  [[nodiscard]] nlohmann::json callbacks(const Observer& observer, Duration now);
  [[nodiscard]] nlohmann::json threads(const Observer& observer);
  void rate(FollowedThread& thread) const;
  static void name_executor(FollowedThread& thread, const Observer& observer);

  const bool whole_;
  nlohmann::json json_;
  std::map<std::pair<ThreadKey, std::uint64_t>, FollowedThread> followed_;  // also by ThreadFacts::started
  Time read_{};
  std::vector<std::uint64_t> jobs_before_;
  std::map<std::uint32_t, double> rates_;  // by callback
  Duration rated_at_{};
};

}  // namespace hotpath::watch
