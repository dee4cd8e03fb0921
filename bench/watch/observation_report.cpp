// SPDX-License-Identifier: Apache-2.0
#include "watch/observation_report.hpp"

#include <algorithm>

#include "hotpath/core/time.hpp"
#include "import/recorded_graph.hpp"
#include "program/text.hpp"

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

/// `/node (timer 100 ms)`, `/node /topic` or `/node /name (service)`.
ObservationReport::Row row_of(const tracing::System& system, const tracing::Callback& callback) {
  const bool known = callback.node < system.nodes.size();
  const std::string node = known ? system.nodes[callback.node] : "(unknown node)";
  const bool service = callback.kind == CallbackKind::service;
  ObservationReport::Row row{"(unknown callback)", {{"node", node}, {"kind", "unknown"}}};
  if (callback.kind == CallbackKind::timer) {
    row.name = program::concat(node, " (timer ", to_ms(callback.period), " ms)");
    row.fields["kind"] = "timer";
    row.fields["period_ms"] = to_ms(callback.period);
  } else if (service || callback.kind == CallbackKind::subscription) {
    const bool named = callback.topic < system.topics.size();
    const std::string topic = named ? system.topics[callback.topic].name : "";
    row.name = node + (named ? " " + topic : "") + (service ? " (service)" : "");
    row.fields["kind"] = service ? "service" : "subscription";
    if (named) row.fields[service ? "service" : "topic"] = topic;
    row.housekeeping = !service && imports::is_housekeeping(topic);
  }
  return row;
}

}  // namespace

void ObservationReport::follow(const ThreadReading& reading) {
  if (reading.facts.empty()) return;
  read_ = reading.at;
  for (const ThreadFacts& facts : reading.facts) {
    FollowedThread& thread = followed_[facts.identity()];
    thread.facts = facts;
    thread.at = read_;
  }
  std::erase_if(followed_, [&](const auto& thread) { return thread.second.at + kEnding < read_; });
}

void ObservationReport::update(Observer& observer, const Session& session, ContractCheck* contract,
                               Duration now) {
  update_callbacks(observer, contract, now);
  if (contract != nullptr) update_chains(*contract);
  update_threads(contract);
  now_ = now;
  events_ = observer.events();
  ignored_ = observer.ignored();
  traced_threads_ = session.threads();
  processes_ = observer.system().processes.size() + observer.system().ended_processes;
  losses_ = session.losses();
}

void ObservationReport::update_callbacks(Observer& observer, ContractCheck* contract, Duration now) {
  const double seconds = to_ms(now - rated_at_) / 1000;
  const bool rates = seconds > 0 && (rated_at_ == Duration::zero() || now - rated_at_ >= kShortest);
  if (rates && !whole_) rated_at_ = now;
  callbacks_.rows.clear();
  jobs_before_.resize(observer.callbacks().size());
  for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
    CallbackObservation& observed = observer.callbacks()[c];
    const std::uint64_t jobs = observed.execution.count();
    if (jobs + observed.lost == 0) continue;
    if (rates) {
      rates_[c] = static_cast<double>(jobs - jobs_before_[c]) / seconds;
      if (!whole_) jobs_before_[c] = jobs;
    }
    Row& row = callbacks_.rows.emplace_back(row_of(observer.system(), observer.system().callbacks[c]));
    row.fields["rate"] = rates_[c];
    row.fields["jobs"] = jobs;
    row.fields["lost"] = observed.lost;
    row.fields["execution_ms"] = stored_ms(observed.execution);
    row.fields["response_ms"] = stored_ms(observed.response);
    row.latest = observed.execution.take_latest_max();
    const std::uint32_t entry = contract ? contract->entry_of(observer.system(), c) : tracing::kNone;
    if (entry != tracing::kNone) row.nearness = contract->nearness_of_callback(entry);
  }
}

void ObservationReport::update_chains(ContractCheck& contract) {
  chains_.rows.clear();
  for (std::uint32_t c = 0; c < contract.chains().size(); ++c) {
    ObservedChain& observed = contract.chains()[c];
    const std::string& name = contract.contract().chains[c].name;
    chains_.rows.push_back({name,
                            {{"chain", name},
                             {"outputs", observed.hot_path.count()},
                             {"hot_path_ms", stored_ms(observed.hot_path)},
                             {"age_ms", stored_ms(observed.age)}},
                            contract.nearness_of_chain(c),
                            observed.age.take_latest_max()});
  }
}

void ObservationReport::update_threads(const ContractCheck* contract) {
  threads_.rows.clear();
  for (auto& [identity, thread] : followed_) {
    const ThreadFacts& of = thread.facts;
    rate(thread);
    const bool changed = thread.first_policy != of.policy;
    const std::string executor = contract != nullptr ? contract->executor_of(of.key()) : "";
    threads_.rows.push_back(
        {executor.empty() ? of.name : executor + " (" + of.name + ")",
         {{"process", of.process},
          {"thread", of.thread},
          {"name", of.name},
          {"executor", executor},
          {"policy", to_string(of.policy)},
          {"policy_before", changed ? nlohmann::json(to_string(thread.first_policy)) : nullptr},
          {"processors", processor_list(of.processors)},
          {"cpu_ms_per_s", thread.ran},
          {"waited_ms_per_s", thread.waited},
          {"withheld_ms_per_s", thread.withheld}},
         changed ? 2.0 : -1.0});
  }
}

void ObservationReport::rate(FollowedThread& thread) const {
  const ThreadFacts& now = thread.facts;
  ThreadFacts& before = thread.before;
  if (thread.before_at == Time{}) {
    before = now;
    thread.before_at = read_;
    thread.first_policy = now.policy;
  }
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

std::string ObservationReport::shown(const Row& row, const Column& column) {
  if (*column.path == '\0') return row.name;
  const nlohmann::json::json_pointer path(column.path);
  if (!row.fields.contains(path)) return "-";
  const nlohmann::json& value = row.fields.at(path);
  if (value.is_null()) return "";
  if (value.is_string()) return value;
  if (value.is_array()) return program::joined(value, ",");
  return value.is_number_float() ? program::fixed(value, column.decimals) : value.dump();
}

std::vector<program::TextTable> ObservationReport::tables() const {
  std::vector<program::TextTable> tables;
  for (const auto& [section, title] :
       {std::pair(&callbacks_, title()), std::pair(&chains_, std::string("Chains")),
        std::pair(&threads_, std::string("Threads"))}) {
    if (section != &callbacks_ && section->rows.empty()) continue;
    std::vector<std::string> header;
    for (const Column& column : section->columns) header.emplace_back(column.header);
    program::TextTable& table = tables.emplace_back(title, header);
    for (const Row& row : section->rows) {
      std::vector<program::TextTable::Cell> cells;
      for (const Column& column : section->columns) cells.emplace_back(shown(row, column));
      if (!row.housekeeping) table.add_row(cells);
    }
  }
  return tables;
}

std::string ObservationReport::title() const {
  std::string title =
      program::concat(program::fixed(to_ms(now_) / 1000, 0), " s: ", processes_, " processes with nodes, ",
                      traced_threads_, " threads, ", events_, " events");
  for (const auto& [count, meaning] :
       {std::pair(losses_.dropped, "dropped"), std::pair(losses_.damaged, "damaged"),
        std::pair(losses_.late, "late"), std::pair(ignored_, "ignored")}) {
    if (count > 0) title += program::concat(", ", count, " ", meaning);
  }
  return title;
}

nlohmann::json ObservationReport::json() const {
  nlohmann::json report = {{"time_s", to_ms(now_) / 1000}, {"processes", processes_},
                           {"threads", traced_threads_},   {"events", events_},
                           {"dropped", losses_.dropped},   {"damaged", losses_.damaged},
                           {"late", losses_.late},         {"ignored_entities", ignored_}};
  for (const Section* const section : {&callbacks_, &chains_, &threads_}) {
    nlohmann::json& rows = report[section->key] = nlohmann::json::array();
    for (const Row& row : section->rows) rows.push_back(row.fields);
  }
  return report;
}

}  // namespace hotpath::watch
