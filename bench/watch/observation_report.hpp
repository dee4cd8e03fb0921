// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "program/text_table.hpp"
#include "watch/observer.hpp"
#include "watch/session.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// `/node (timer 100 ms)`, `/node /topic` or `/node (service)`.
[[nodiscard]] std::string shown_name(const tracing::System& system, std::uint32_t callback);

/// The state of a watched system at one instant, for people and for programs.
class ObservationReport {
 public:
  struct ThreadRow {
    std::string executor;  ///< Of the contract; empty: unknown.
    ThreadFacts facts;
    std::optional<ThreadPolicy> original;      ///< The first policy, if it has changed.
    double ran = 0, waited = 0, withheld = 0;  ///< Since the previous update, ms in a second.
  };
  struct ChainRow {
    std::string name;
    std::uint64_t outputs = 0;
    Duration hot_path_p99{}, hot_path_max{}, age_p99{}, age_max{};  ///< -1 ns: none.
    Duration latest{-1};  ///< Largest age since the previous update.
    double nearness = -1;
  };
  struct Row {
    std::string name;
    nlohmann::json fields;
    bool housekeeping = false;  ///< Every node has it; not in the table.
    double rate = 0;            ///< Jobs a second since the previous update.
    std::uint64_t jobs = 0, lost = 0;
    double nearness = -1;  ///< Largest share of a limit that was reached; -1: unknown.
    Duration latest{-1};   ///< Longest execution since the previous update; -1 ns: none.
    Duration execution_p99{}, execution_max{}, response_p99{}, response_max{};  ///< -1 ns: none.
  };

  /// `whole`: rates are those since the beginning, of threads since they were first seen.
  explicit ObservationReport(bool whole) : whole_(whole) {}

  /// Facts of the system's threads, which are older than the report.
  struct Reading {
    const std::vector<ThreadFacts>& facts;
    Duration at{};  ///< Since the beginning.
  };
  /// `contract`: nullptr: none; `now`: since the beginning. Rates of less than half a second since those
  /// before are not shown: the previous ones stay.
  void update(const Observer& observer, const Session& session, const Reading& reading,
              ContractCheck* contract, Duration now);

  /// One row for each callback that ran or lost samples, for each chain of the contract, and for
  /// each thread that runs callbacks.
  [[nodiscard]] std::vector<program::TextTable> tables() const;
  [[nodiscard]] nlohmann::json json() const;
  /// One line about all.
  [[nodiscard]] std::string title() const;
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  [[nodiscard]] const std::vector<ChainRow>& chains() const { return chains_; }
  [[nodiscard]] const std::vector<ThreadRow>& executor_threads() const { return executor_threads_; }

 private:
  /// A thread's earlier facts, and its rates since then.
  struct Before {
    ThreadFacts facts;
    Duration at{};
    double ran = 0, waited = 0, withheld = 0;
  };
  void update_chains(const ContractCheck& contract);
  void update_threads(const Reading& reading, const ContractCheck* contract);
  [[nodiscard]] program::TextTable callback_table() const;
  [[nodiscard]] program::TextTable chain_table() const;
  [[nodiscard]] program::TextTable thread_table() const;
  [[nodiscard]] nlohmann::json chains_json() const;
  [[nodiscard]] nlohmann::json threads_json() const;

  bool whole_;
  std::vector<Row> rows_;
  std::vector<ChainRow> chains_;
  std::vector<ThreadRow> executor_threads_;
  std::map<std::pair<ThreadKey, std::uint64_t>, Before> before_;                // by identity of the thread
  std::map<std::pair<ThreadKey, std::uint64_t>, ThreadPolicy> first_policies_;  // the same
  std::vector<std::uint64_t> jobs_before_;
  std::map<std::uint32_t, double> rates_;  // by callback
  Duration now_{}, rated_at_{};
  std::uint64_t events_ = 0, threads_ = 0, processes_ = 0, ignored_ = 0;
  Losses losses_;
};

/// As tables show it, without a unit: "-" if negative.
[[nodiscard]] std::string shown_ms(Duration duration);

}  // namespace hotpath::watch
