// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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
    json_ = {{"time_s", to_ms(now) / 1000},
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
    std::vector<program::Table> tables = {table_of("callbacks", title,
                                                   {{"/name", "callback"},
                                                    {"/rate", "jobs/s", 1},
                                                    {"/jobs", "jobs"},
                                                    {"/lost", "lost"},
                                                    {"/execution_ms/p99", "execution\np99 ms"},
                                                    {"/execution_ms/max", "execution\nmax ms"},
                                                    {"/response_ms/p99", "response\np99 ms"},
                                                    {"/response_ms/max", "response\nmax ms"}})};
    if (!json_["chains"].empty())
      tables.push_back(table_of("chains", "Chains",
                                {{"/chain", "chain"},
                                 {"/outputs", "outputs"},
                                 {"/hot_path_ms/p99", "hot path\np99 ms"},
                                 {"/hot_path_ms/max", "hot path\nmax ms"},
                                 {"/age_ms/p99", "age\np99 ms"},
                                 {"/age_ms/max", "age\nmax ms"}}));
    if (!json_["executor_threads"].empty())
      tables.push_back(table_of("executor_threads", "Threads",
                                {{"/process", "process"},
                                 {"/thread", "thread"},
                                 {"/name", "name"},
                                 {"/executor", "executor"},
                                 {"/policy", "policy"},
                                 {"/policy_before", "before"},
                                 {"/processors", "processors"},
                                 {"/cpu_ms_per_s", "CPU\nms/s", 1},
                                 {"/waited_ms_per_s", "waited\nms/s", 1},
                                 {"/withheld_ms_per_s", "withheld\nms/s", 1}}));
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
    double ran = 0, waited = 0, withheld = 0;  ///< ms in a second.
  };
  /// What a table shows of the rows of JSON: a pointer into the row, and the header.
  struct Column {
    const char *path, *header;
    int decimals = 3;
  };

  static void name_executor(FollowedThread& thread, const Observer& observer) {
    if (thread.executor.empty()) thread.executor = observer.executor_of(thread.facts.key());
  }
  static nlohmann::json stored_ms(const program::LatencyHistogram& observed) {
    if (observed.max() < Duration::zero()) return nullptr;
    return {{"p99", to_ms(observed.quantile(0.99))}, {"max", to_ms(observed.max())}};
  }

  [[nodiscard]] nlohmann::json callbacks(const Observer& observer, Duration now) {
    const double seconds = to_ms(now - rated_at_) / 1000;
    const bool rates = seconds > 0 && (rated_at_ == Duration::zero() || now - rated_at_ >= kShortest);
    if (rates && !whole_) rated_at_ = now;
    jobs_before_.resize(observer.callbacks().size());
    nlohmann::json rows = nlohmann::json::array();
    for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
      const CallbackObservation& observed = observer.callbacks()[c];
      const std::uint64_t jobs = observed.execution.count();
      if (jobs + observed.lost == 0) continue;
      if (rates) {
        rates_[c] = static_cast<double>(jobs - jobs_before_[c]) / seconds;
        if (!whole_) jobs_before_[c] = jobs;
      }
      nlohmann::json& row = rows.emplace_back(named(observer.system(), observer.system().callbacks[c]));
      row["rate"] = rates_[c];
      row["jobs"] = jobs;
      row["lost"] = observed.lost;
      row["execution_ms"] = stored_ms(observed.execution);
      row["response_ms"] = stored_ms(observed.response);
    }
    return rows;
  }
  /// The fields that name a callback.
  static nlohmann::json named(const tracing::System& system, const tracing::Callback& callback) {
    using Of = tracing::CallbackKind;
    const bool timer = callback.kind == Of::timer, service = callback.kind == Of::service,
               subscription = callback.kind == Of::subscription;
    const char* const other = subscription ? "subscription" : "unknown";
    nlohmann::json fields = {{"name", callback_name(system, callback)},
                             {"node", node_name(system, callback.node)},
                             {"kind", timer     ? "timer"
                                      : service ? "service"
                                                : other}};
    if (timer) fields["period_ms"] = to_ms(callback.period);
    if ((service || subscription) && callback.topic < system.topics.size())
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
                      {"processors", of.processors},
                      {"cpu_ms_per_s", thread.ran},
                      {"waited_ms_per_s", thread.waited},
                      {"withheld_ms_per_s", thread.withheld}});
    }
    return rows;
  }
  void rate(FollowedThread& thread) const {
    const ThreadFacts &now = thread.facts, &before = thread.before;
    if (read_ - thread.before_at < kShortest) return;
    const double seconds = to_ms(read_ - thread.before_at) / 1000;
    thread.ran = to_ms(now.ran - before.ran) / seconds;
    thread.waited = to_ms(now.waited - before.waited) / seconds;
    const bool stayed = now.processor == before.processor;  // each one has a counter of its own
    thread.withheld = stayed ? to_ms(now.stolen - before.stolen) / seconds : 0;
    if (whole_) return;
    thread.before = now;
    thread.before_at = read_;
  }

  [[nodiscard]] program::Table table_of(const char* key, const std::string& title,
                                        const std::vector<Column>& columns) const {
    program::Table table(title);
    for (const Column& column : columns) table.header.emplace_back(column.header);
    for (const nlohmann::json& row : json_[key]) {
      if (imports::is_housekeeping(row.value("topic", ""))) continue;  // every node has it
      std::vector<program::Value>& cells = table.rows.emplace_back();
      for (const Column& column : columns) cells.emplace_back(shown(row, column));
    }
    return table;
  }
  /// A cell of a table; "-": the row has no such field.
  static std::string shown(const nlohmann::json& row, const Column& column) {
    const nlohmann::json::json_pointer path(column.path);
    if (!row.contains(path)) return "-";
    const nlohmann::json& value = row.at(path);
    if (value.is_null()) return "";
    if (value.is_string()) return value;
    if (value.is_array()) return program::joined(value, ",");
    return value.is_number_float() ? program::fixed(value, column.decimals) : value.dump();
  }

  const bool whole_;
  nlohmann::json json_;
  std::map<std::pair<ThreadKey, std::uint64_t>, FollowedThread> followed_;  // also by ThreadFacts::started
  Time read_{};
  std::vector<std::uint64_t> jobs_before_;
  std::map<std::uint32_t, double> rates_;  // by callback
  Duration rated_at_{};
};

}  // namespace hotpath::watch
