// SPDX-License-Identifier: Apache-2.0
#include "watch/observation_report.hpp"

#include <string>

#include "hotpath/core/time.hpp"
#include "import/recorded_graph.hpp"
#include "program/text.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

namespace {

using tracing::CallbackKind;

/// Time over which a rate is shown.
constexpr Duration kShortest = std::chrono::milliseconds(500);
/// For which the threads of a process may end one after another.
constexpr Duration kEnding = std::chrono::seconds(1);

nlohmann::json stored_ms(const program::LatencyHistogram& observed) {
  if (observed.max() < Duration::zero()) return nullptr;
  return {{"p99", to_ms(observed.quantile(0.99))}, {"max", to_ms(observed.max())}};
}

/// The fields that name a callback.
nlohmann::json named(const tracing::System& system, const tracing::Callback& callback) {
  nlohmann::json fields = {{"name", callback_name(system, callback)},
                           {"node", node_name(system, callback.node)},
                           {"kind", "unknown"}};
  const bool service = callback.kind == CallbackKind::service;
  if (callback.kind == CallbackKind::timer) {
    fields["kind"] = "timer";
    fields["period_ms"] = to_ms(callback.period);
  } else if (service || callback.kind == CallbackKind::subscription) {
    fields["kind"] = service ? "service" : "subscription";
    if (callback.topic < system.topics.size())
      fields[service ? "service" : "topic"] = system.topics[callback.topic].name;
  }
  return fields;
}

nlohmann::json chains_of(const Observer& observer) {
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

/// What a table shows of the rows of JSON: a pointer into the row, and the header.
struct Column {
  const char *path, *header;
  int decimals = 3;
};
using Columns = std::vector<Column>;

const Columns kCallbacks = {{"/name", "callback"},
                            {"/rate", "jobs/s", 1},
                            {"/jobs", "jobs"},
                            {"/lost", "lost"},
                            {"/execution_ms/p99", "execution\np99 ms"},
                            {"/execution_ms/max", "execution\nmax ms"},
                            {"/response_ms/p99", "response\np99 ms"},
                            {"/response_ms/max", "response\nmax ms"}};
const Columns kChains = {{"/chain", "chain"},
                         {"/outputs", "outputs"},
                         {"/hot_path_ms/p99", "hot path\np99 ms"},
                         {"/hot_path_ms/max", "hot path\nmax ms"},
                         {"/age_ms/p99", "age\np99 ms"},
                         {"/age_ms/max", "age\nmax ms"}};
const Columns kThreads = {{"/process", "process"},
                          {"/thread", "thread"},
                          {"/name", "name"},
                          {"/executor", "executor"},
                          {"/policy", "policy"},
                          {"/policy_before", "before"},
                          {"/processors", "processors"},
                          {"/cpu_ms_per_s", "CPU\nms/s", 1},
                          {"/waited_ms_per_s", "waited\nms/s", 1},
                          {"/withheld_ms_per_s", "withheld\nms/s", 1}};

/// A cell of a table; "-": the row has no such field.
std::string shown(const nlohmann::json& row, const Column& column) {
  const nlohmann::json::json_pointer path(column.path);
  if (!row.contains(path)) return "-";
  const nlohmann::json& value = row.at(path);
  if (value.is_null()) return "";
  if (value.is_string()) return value;
  if (value.is_array()) return program::joined(value, ",");
  return value.is_number_float() ? program::fixed(value, column.decimals) : value.dump();
}

program::Table table_of(const nlohmann::json& rows, const std::string& title, const Columns& columns) {
  std::vector<std::string> header;
  for (const Column& column : columns) header.emplace_back(column.header);
  program::Table table(title, header);
  for (const nlohmann::json& row : rows) {
    if (imports::is_housekeeping(row.value("topic", ""))) continue;  // every node has it
    std::vector<program::Value> cells;
    for (const Column& column : columns) cells.emplace_back(shown(row, column));
    table.add_row(cells);
  }
  return table;
}

}  // namespace

void ObservationReport::name_executor(FollowedThread& thread, const Observer& observer) {
  if (thread.executor.empty()) thread.executor = observer.executor_of(thread.facts.key());
}

void ObservationReport::follow(const ThreadReading& reading, const Observer& observer) {
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

void ObservationReport::update(const Observer& observer, const Session& session, Duration now) {
  const Losses losses = session.losses();
  json_ = {{"time_s", to_ms(now) / 1000},
           {"processes", observer.system().processes.size() + observer.system().ended_processes},
           {"threads", session.threads()},
           {"events", observer.events()},
           {"dropped", losses.dropped},
           {"damaged", losses.damaged},
           {"late", losses.late},
           {"ignored_entities", observer.system().ignored},
           {"callbacks", callbacks(observer, now)},
           {"chains", chains_of(observer)},
           {"executor_threads", threads(observer)}};
}

nlohmann::json ObservationReport::callbacks(const Observer& observer, Duration now) {
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

nlohmann::json ObservationReport::threads(const Observer& observer) {
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

void ObservationReport::rate(FollowedThread& thread) const {
  const ThreadFacts& now = thread.facts;
  ThreadFacts& before = thread.before;
  if (read_ - thread.before_at < kShortest) return;
  const double seconds = to_ms(read_ - thread.before_at) / 1000;
  thread.ran = to_ms(now.ran - before.ran) / seconds;
  thread.waited = to_ms(now.waited - before.waited) / seconds;
  const bool stayed = now.processor == before.processor;  // each one has a counter of its own
  thread.withheld = stayed ? to_ms(now.stolen - before.stolen) / seconds : 0;
  if (whole_) return;
  before = now;
  thread.before_at = read_;
}

std::vector<program::Table> ObservationReport::tables() const {
  std::string title =
      program::concat(program::fixed(json_["time_s"], 0), " s: ", json_["processes"],
                      " processes with nodes, ", json_["threads"], " threads, ", json_["events"], " events");
  for (const auto& [key, meaning] : {std::pair("dropped", "dropped"), std::pair("damaged", "damaged"),
                                     std::pair("late", "late"), std::pair("ignored_entities", "ignored")})
    if (json_[key] > 0) title += program::concat(", ", json_[key], " ", meaning);
  std::vector<program::Table> tables = {table_of(json_["callbacks"], title, kCallbacks)};
  if (!json_["chains"].empty()) tables.push_back(table_of(json_["chains"], "Chains", kChains));
  if (!json_["executor_threads"].empty())
    tables.push_back(table_of(json_["executor_threads"], "Threads", kThreads));
  return tables;
}

}  // namespace hotpath::watch
