// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "program/text_table.hpp"
#include "watch/observer.hpp"
#include "watch/session.hpp"
#include "watch/thread_facts.hpp"

namespace hotpath::watch {

/// The state of a watched system at one instant, for people and for programs.
class ObservationReport {
 public:
  /// A callback, a chain of the contract, or a thread.
  struct Row {
    std::string name;
    nlohmann::json fields;  ///< In a line of JSON.
    /// Largest share of a limit that was reached; -1: unknown. Threads: 2 if the policy has changed.
    double nearness = -1;
    Duration latest{-1};        ///< Longest execution or age since the previous update; -1 ns: none.
    bool housekeeping = false;  ///< Every node has it: only in JSON.
  };
  /// What tables and screens show of a row.
  struct Column {
    const char* path;    ///< JSON pointer to one of its fields; "": its name.
    const char* header;  ///< In the table.
    const char* title;   ///< On a screen; "": not there.
    int decimals = 3;
  };
  /// Rows of one kind.
  struct Section {
    const char* key;      ///< In a line of JSON.
    const char* heading;  ///< On a screen.
    const char* history;  ///< The same, of the last minute of `latest`; "": there is none.
    std::vector<Column> columns;
    std::vector<Row> rows = {};
  };

  /// `whole`: rates are those since the beginning, of threads since they were first seen.
  explicit ObservationReport(bool whole) : whole_(whole) {}

  /// Facts for the next update. Those of threads that have just ended stay, because their process may be
  /// about to end; when all have ended, the last ones stay.
  void follow(const ThreadReading& reading);
  /// `contract`: nullptr: none; `now`: since the beginning. Rates of less than half a second since those
  /// before are not shown: the previous ones stay.
  void update(Observer& observer, const Session& session, ContractCheck* contract, Duration now);

  /// The sections that are not empty; callbacks always.
  [[nodiscard]] std::vector<program::TextTable> tables() const;
  [[nodiscard]] nlohmann::json json() const;
  /// One line about all.
  [[nodiscard]] std::string title() const;
  /// The callbacks that ran or lost samples.
  [[nodiscard]] const Section& callbacks() const { return callbacks_; }
  [[nodiscard]] const Section& chains() const { return chains_; }
  /// The threads that run callbacks.
  [[nodiscard]] const Section& threads() const { return threads_; }
  /// As tables and screens show it; "-": there is none.
  [[nodiscard]] static std::string shown(const Row& row, const Column& column);

 private:
  struct FollowedThread {
    ThreadFacts facts, before;  ///< The latest ones, and those from which its rates count.
    Time at{}, before_at{};     ///< Of both; Time{}: no report had the thread.
    ThreadPolicy first_policy;
    double ran = 0, waited = 0, withheld = 0;  ///< ms in a second.
  };
  void update_callbacks(Observer& observer, ContractCheck* contract, Duration now);
  void update_chains(ContractCheck& contract);
  void update_threads(const ContractCheck* contract);
  void rate(FollowedThread& thread) const;

  bool whole_;
  Section callbacks_{"callbacks",
                     "CALLBACK",
                     "run, last minute",
                     {{"", "callback", ""},
                      {"/rate", "jobs/s", "jobs/s", 1},
                      {"/jobs", "jobs", ""},
                      {"/lost", "lost", "lost"},
                      {"/execution_ms/p99", "execution\np99 ms", "run p99"},
                      {"/execution_ms/max", "execution\nmax ms", "run max"},
                      {"/response_ms/p99", "response\np99 ms", ""},
                      {"/response_ms/max", "response\nmax ms", "resp. max"}}};
  Section chains_{"chains",
                  "CHAIN",
                  "age, last minute",
                  {{"", "chain", ""},
                   {"/outputs", "outputs", "outputs"},
                   {"/hot_path_ms/p99", "hot path\np99 ms", "path p99"},
                   {"/hot_path_ms/max", "hot path\nmax ms", "path max"},
                   {"/age_ms/p99", "age\np99 ms", "age p99"},
                   {"/age_ms/max", "age\nmax ms", "age max"}}};
  Section threads_{"executor_threads",
                   "THREAD",
                   "",
                   {{"/process", "process", "process"},
                    {"/thread", "thread", "thread"},
                    {"/name", "name", ""},
                    {"/executor", "executor", ""},
                    {"/policy", "policy", "policy"},
                    {"/policy_before", "before", ""},
                    {"/processors", "processors", "processors"},
                    {"/cpu_ms_per_s", "CPU\nms/s", "CPU ms/s", 1},
                    {"/waited_ms_per_s", "waited\nms/s", "wait ms/s", 1},
                    {"/withheld_ms_per_s", "withheld\nms/s", "", 1}}};
  std::map<std::pair<ThreadKey, std::uint64_t>, FollowedThread> followed_;  // by identity
  Time read_{};
  std::vector<std::uint64_t> jobs_before_;
  std::map<std::uint32_t, double> rates_;  // by callback
  Duration now_{}, rated_at_{};
  std::uint64_t events_ = 0, traced_threads_ = 0, processes_ = 0, ignored_ = 0;
  Losses losses_;
};

}  // namespace hotpath::watch
