// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "program/text_table.hpp"
#include "watch/observer.hpp"
#include "watch/session.hpp"

namespace hotpath::watch {

/// `/node (timer 100 ms)`, `/node /topic` or `/node (service)`.
[[nodiscard]] std::string shown_name(const tracing::System& system, std::uint32_t callback);

/// The state of a watched system at one instant, for people and for programs.
class ObservationReport {
 public:
  /// `now`: since the beginning.
  void update(const Observer& observer, const Session& session, Duration now);

  /// One row for each callback that ran or lost samples.
  [[nodiscard]] program::TextTable table() const;
  [[nodiscard]] nlohmann::json json() const;

 private:
  struct Row {
    std::string name;
    nlohmann::json fields;
    double rate = 0;  ///< Jobs a second since the previous update.
    std::uint64_t jobs = 0, lost = 0;
    Duration execution_p99{}, execution_max{}, response_p99{}, response_max{};  ///< -1 ns: none.
  };

  std::vector<Row> rows_;
  std::vector<std::uint64_t> jobs_before_;
  Duration now_{};
  std::uint64_t events_ = 0, threads_ = 0, processes_ = 0, ignored_ = 0;
  Losses losses_;
};

}  // namespace hotpath::watch
