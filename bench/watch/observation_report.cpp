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

std::string node_of(const tracing::System& system, const tracing::Callback& callback) {
  return callback.node < system.nodes.size() ? system.nodes[callback.node] : "(unknown node)";
}

nlohmann::json stored_ms(Duration p99, Duration max) {
  if (max < Duration::zero()) return nullptr;
  return {{"p99", to_ms(p99)}, {"max", to_ms(max)}};
}

nlohmann::json fields_of(const tracing::System& system, const tracing::Callback& callback) {
  nlohmann::json fields{{"node", node_of(system, callback)}};
  switch (callback.kind) {
    case CallbackKind::timer:
      fields["kind"] = "timer";
      fields["period_ms"] = to_ms(callback.period);
      break;
    case CallbackKind::subscription:
      fields["kind"] = "subscription";
      fields["topic"] = system.topics[callback.topic].name;
      break;
    case CallbackKind::service:
      fields["kind"] = "service";
      break;
    case CallbackKind::client:
    case CallbackKind::unannounced:
    case CallbackKind::unknown:
      fields["kind"] = "unknown";
      break;
  }
  return fields;
}

}  // namespace

std::string shown_ms(Duration duration) {
  return duration < Duration::zero() ? "-" : program::fixed(to_ms(duration), 3);
}

std::string shown_name(const tracing::System& system, std::uint32_t callback) {
  const tracing::Callback& of = system.callbacks[callback];
  const std::string node = node_of(system, of);
  switch (of.kind) {
    case CallbackKind::timer:
      return program::concat(node, " (timer ", to_ms(of.period), " ms)");
    case CallbackKind::subscription:
      return node + " " + system.topics[of.topic].name;
    case CallbackKind::service:
      return "(service)";
    case CallbackKind::client:
    case CallbackKind::unannounced:
    case CallbackKind::unknown:
      break;
  }
  return "(unknown callback)";
}

void ObservationReport::update(const Observer& observer, const Session& session, const Reading& reading,
                               ContractCheck* contract, Duration now) {
  const double seconds = to_ms(now - rated_at_) / 1000;
  const bool rates = seconds > 0 && (rated_at_ == Duration::zero() || now - rated_at_ >= kShortest);
  if (rates && !whole_) rated_at_ = now;
  rows_.clear();
  jobs_before_.resize(observer.callbacks().size());
  for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
    const CallbackObservation& observed = observer.callbacks()[c];
    if (observed.jobs + observed.lost == 0) continue;
    Row& row = rows_.emplace_back();
    row.name = shown_name(observer.system(), c);
    row.fields = fields_of(observer.system(), observer.system().callbacks[c]);
    row.housekeeping = imports::is_housekeeping(row.fields.value("topic", ""));
    if (rates) {
      rates_[c] = static_cast<double>(observed.jobs - jobs_before_[c]) / seconds;
      if (!whole_) jobs_before_[c] = observed.jobs;
    }
    row.rate = rates_[c];
    row.jobs = observed.jobs;
    row.lost = observed.lost;
    row.latest = observed.latest;
    row.execution_p99 = observed.execution.quantile(0.99);
    row.execution_max = observed.execution.max();
    row.response_p99 = observed.response.quantile(0.99);
    row.response_max = observed.response.max();
    const std::uint32_t entry = contract ? contract->entry_of(observer.system(), c) : tracing::kNone;
    if (entry != tracing::kNone) row.nearness = contract->nearness_of_callback(entry);
  }
  if (contract != nullptr) update_chains(*contract);
  update_threads(reading, contract);
  now_ = now;
  events_ = observer.events();
  ignored_ = observer.ignored();
  threads_ = session.threads();
  processes_ = observer.system().processes.size();
  losses_ = session.losses();
}

void ObservationReport::update_chains(const ContractCheck& contract) {
  chains_.clear();
  for (std::uint32_t c = 0; c < contract.chains().size(); ++c) {
    const ObservedChain& observed = contract.chains()[c];
    ChainRow& row = chains_.emplace_back();
    row.name = contract.contract().chains[c].name;
    row.outputs = observed.outputs;
    row.hot_path_p99 = observed.hot_path.quantile(0.99);
    row.hot_path_max = observed.hot_path.max();
    row.age_p99 = observed.age.quantile(0.99);
    row.age_max = observed.age.max();
    row.latest = observed.latest;
    row.nearness = contract.nearness_of_chain(c);
  }
}

void ObservationReport::update_threads(const Reading& reading, const ContractCheck* contract) {
  const std::vector<ThreadFacts>& facts = reading.facts;
  executor_threads_.clear();
  for (const ThreadFacts& of : facts) {
    ThreadRow& row = executor_threads_.emplace_back();
    row.facts = of;
    if (contract != nullptr) row.executor = contract->executor_of(of.key());
    const auto [first, is_new] = first_policies_.try_emplace(of.identity(), of.policy);
    if (!(first->second == of.policy)) row.original = first->second;
    Before& before = before_.try_emplace(of.identity(), Before{of, reading.at}).first->second;
    if (reading.at - before.at >= kShortest) {
      const double seconds = to_ms(reading.at - before.at) / 1000;
      before.ran = to_ms(of.ran - before.facts.ran) / seconds;
      before.waited = to_ms(of.waited - before.facts.waited) / seconds;
      const bool stayed = of.processor == before.facts.processor;  // each one has a counter of its own
      before.withheld = stayed ? to_ms(of.stolen - before.facts.stolen) / seconds : 0;
      if (!whole_) {
        before.facts = of;
        before.at = reading.at;
      }
    }
    row.ran = before.ran;
    row.waited = before.waited;
    row.withheld = before.withheld;
  }
  std::erase_if(before_, [&](const auto& before) {
    return std::ranges::find(facts, before.first, &ThreadFacts::identity) == facts.end();
  });
  std::erase_if(first_policies_, [&](const auto& first) { return !before_.contains(first.first); });
}

std::vector<program::TextTable> ObservationReport::tables() const {
  std::vector<program::TextTable> tables = {callback_table()};
  if (!chains_.empty()) tables.push_back(chain_table());
  if (!executor_threads_.empty()) tables.push_back(thread_table());
  return tables;
}

program::TextTable ObservationReport::chain_table() const {
  program::TextTable table(
      "Chains", {"chain", "outputs", "hot path\np99 ms", "hot path\nmax ms", "age\np99 ms", "age\nmax ms"});
  for (const ChainRow& row : chains_) {
    table.add_row({row.name, program::concat(row.outputs), shown_ms(row.hot_path_p99),
                   shown_ms(row.hot_path_max), shown_ms(row.age_p99), shown_ms(row.age_max)});
  }
  return table;
}

program::TextTable ObservationReport::thread_table() const {
  program::TextTable table("Threads", {"process", "thread", "name", "executor", "policy", "before",
                                       "processors", "CPU\nms/s", "waited\nms/s", "withheld\nms/s"});
  for (const ThreadRow& row : executor_threads_) {
    table.add_row({program::concat(row.facts.process), program::concat(row.facts.thread), row.facts.name,
                   row.executor, to_string(row.facts.policy),
                   row.original ? to_string(*row.original) : std::string(),
                   shown_processors(row.facts.processors), program::fixed(row.ran, 1),
                   program::fixed(row.waited, 1), program::fixed(row.withheld, 1)});
  }
  return table;
}

std::string ObservationReport::title() const {
  std::string title =
      program::text("%.0f s: %llu processes with nodes, %llu threads, %llu events", to_ms(now_) / 1000,
                    static_cast<unsigned long long>(processes_), static_cast<unsigned long long>(threads_),
                    static_cast<unsigned long long>(events_));
  for (const auto& [count, meaning] :
       {std::pair(losses_.dropped, "dropped"), std::pair(losses_.damaged, "damaged"),
        std::pair(losses_.late, "late"), std::pair(ignored_, "ignored")}) {
    if (count > 0) title += program::concat(", ", count, " ", meaning);
  }
  return title;
}

program::TextTable ObservationReport::callback_table() const {
  program::TextTable table(title(), {"callback", "jobs/s", "jobs", "lost", "execution\np99 ms",
                                     "execution\nmax ms", "response\np99 ms", "response\nmax ms"});
  for (const Row& row : rows_) {
    if (row.housekeeping) continue;
    table.add_row({row.name, program::fixed(row.rate, 1), program::concat(row.jobs),
                   program::concat(row.lost), shown_ms(row.execution_p99), shown_ms(row.execution_max),
                   shown_ms(row.response_p99), shown_ms(row.response_max)});
  }
  return table;
}

nlohmann::json ObservationReport::json() const {
  nlohmann::json callbacks = nlohmann::json::array();
  for (const Row& row : rows_) {
    nlohmann::json& callback = callbacks.emplace_back(row.fields);
    callback["rate"] = row.rate;
    callback["jobs"] = row.jobs;
    callback["lost"] = row.lost;
    callback["execution_ms"] = stored_ms(row.execution_p99, row.execution_max);
    callback["response_ms"] = stored_ms(row.response_p99, row.response_max);
  }
  return {{"time_s", to_ms(now_) / 1000},
          {"processes", processes_},
          {"threads", threads_},
          {"events", events_},
          {"dropped", losses_.dropped},
          {"damaged", losses_.damaged},
          {"late", losses_.late},
          {"ignored_entities", ignored_},
          {"callbacks", callbacks},
          {"chains", chains_json()},
          {"executor_threads", threads_json()}};
}

nlohmann::json ObservationReport::chains_json() const {
  nlohmann::json chains = nlohmann::json::array();
  for (const ChainRow& row : chains_) {
    chains.push_back({{"chain", row.name},
                      {"outputs", row.outputs},
                      {"hot_path_ms", stored_ms(row.hot_path_p99, row.hot_path_max)},
                      {"age_ms", stored_ms(row.age_p99, row.age_max)}});
  }
  return chains;
}

nlohmann::json ObservationReport::threads_json() const {
  nlohmann::json threads = nlohmann::json::array();
  for (const ThreadRow& row : executor_threads_) {
    threads.push_back({{"process", row.facts.process},
                       {"thread", row.facts.thread},
                       {"name", row.facts.name},
                       {"executor", row.executor},
                       {"policy", to_string(row.facts.policy)},
                       {"policy_before", row.original ? nlohmann::json(to_string(*row.original)) : nullptr},
                       {"processors", processor_list(row.facts.processors)},
                       {"cpu_ms_per_s", row.ran},
                       {"waited_ms_per_s", row.waited},
                       {"withheld_ms_per_s", row.withheld}});
  }
  return threads;
}

}  // namespace hotpath::watch
