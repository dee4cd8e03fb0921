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

nlohmann::json stored_ms(const program::LatencyHistogram& observed) {
  if (observed.max() < Duration::zero()) return nullptr;
  return {{"p99", to_ms(observed.quantile(0.99))}, {"max", to_ms(observed.max())}};
}

/// `/node (timer 100 ms)`, `/node /topic` or `/node /name (service)`.
ObservationReport::Row row_of(const tracing::System& system, const tracing::Callback& callback) {
  const bool known = callback.node < system.nodes.size();
  const std::string node = known ? system.nodes[callback.node] : "(unknown node)";
  ObservationReport::Row row{"(unknown callback)", {{"node", node}, {"kind", "unknown"}}};
  if (callback.kind == CallbackKind::timer) {
    row.name = program::concat(node, " (timer ", to_ms(callback.period), " ms)");
    row.fields["kind"] = "timer";
    row.fields["period_ms"] = to_ms(callback.period);
  } else if (callback.kind == CallbackKind::subscription) {
    const std::string& topic = system.topics[callback.topic].name;
    row.name = node + " " + topic;
    row.fields["kind"] = "subscription";
    row.fields["topic"] = topic;
    row.housekeeping = imports::is_housekeeping(topic);
  } else if (callback.kind == CallbackKind::service) {
    const bool named = callback.topic < system.topics.size();
    row.name = node + (named ? " " + system.topics[callback.topic].name : "") + " (service)";
    row.fields["kind"] = "service";
    if (named) row.fields["service"] = system.topics[callback.topic].name;
  }
  return row;
}

}  // namespace

void ObservationReport::update(const Observer& observer, const Session& session, const Reading& reading,
                               ContractCheck* contract, Duration now) {
  update_callbacks(observer, contract, now);
  if (contract != nullptr) update_chains(*contract);
  update_threads(reading, contract);
  now_ = now;
  events_ = observer.events();
  ignored_ = observer.ignored();
  traced_threads_ = session.threads();
  processes_ = observer.system().processes.size() + observer.system().ended_processes;
  losses_ = session.losses();
}

void ObservationReport::update_callbacks(const Observer& observer, ContractCheck* contract, Duration now) {
  const double seconds = to_ms(now - rated_at_) / 1000;
  const bool rates = seconds > 0 && (rated_at_ == Duration::zero() || now - rated_at_ >= kShortest);
  if (rates && !whole_) rated_at_ = now;
  callbacks_.rows.clear();
  jobs_before_.resize(observer.callbacks().size());
  for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
    const CallbackObservation& observed = observer.callbacks()[c];
    if (observed.jobs + observed.lost == 0) continue;
    if (rates) {
      rates_[c] = static_cast<double>(observed.jobs - jobs_before_[c]) / seconds;
      if (!whole_) jobs_before_[c] = observed.jobs;
    }
    Row& row = callbacks_.rows.emplace_back(row_of(observer.system(), observer.system().callbacks[c]));
    row.fields["rate"] = rates_[c];
    row.fields["jobs"] = observed.jobs;
    row.fields["lost"] = observed.lost;
    row.fields["execution_ms"] = stored_ms(observed.execution);
    row.fields["response_ms"] = stored_ms(observed.response);
    row.latest = observed.latest;
    const std::uint32_t entry = contract ? contract->entry_of(observer.system(), c) : tracing::kNone;
    if (entry != tracing::kNone) row.nearness = contract->nearness_of_callback(entry);
  }
}

void ObservationReport::update_chains(const ContractCheck& contract) {
  chains_.rows.clear();
  for (std::uint32_t c = 0; c < contract.chains().size(); ++c) {
    const ObservedChain& observed = contract.chains()[c];
    const std::string& name = contract.contract().chains[c].name;
    chains_.rows.push_back({name,
                            {{"chain", name},
                             {"outputs", observed.outputs},
                             {"hot_path_ms", stored_ms(observed.hot_path)},
                             {"age_ms", stored_ms(observed.age)}},
                            contract.nearness_of_chain(c),
                            observed.latest});
  }
}

void ObservationReport::update_threads(const Reading& reading, const ContractCheck* contract) {
  const std::vector<ThreadFacts>& facts = reading.facts;
  threads_.rows.clear();
  for (const ThreadFacts& of : facts) {
    const Before& rates = rates_of(of, reading.at);
    const bool changed = !(rates.first_policy == of.policy);
    const std::string executor = contract != nullptr ? contract->executor_of(of.key()) : "";
    threads_.rows.push_back(
        {executor.empty() ? of.name : executor + " (" + of.name + ")",
         {{"process", of.process},
          {"thread", of.thread},
          {"name", of.name},
          {"executor", executor},
          {"policy", to_string(of.policy)},
          {"policy_before", changed ? nlohmann::json(to_string(rates.first_policy)) : nullptr},
          {"processors", processor_list(of.processors)},
          {"cpu_ms_per_s", rates.ran},
          {"waited_ms_per_s", rates.waited},
          {"withheld_ms_per_s", rates.withheld}},
         changed ? 2.0 : -1.0});
  }
  std::erase_if(before_, [&](const auto& before) {
    return std::ranges::find(facts, before.first, &ThreadFacts::identity) == facts.end();
  });
}

ObservationReport::Before& ObservationReport::rates_of(const ThreadFacts& facts, Duration at) {
  Before& before = before_.try_emplace(facts.identity(), Before{facts, facts.policy, at}).first->second;
  if (at - before.at < kShortest) return before;
  const double seconds = to_ms(at - before.at) / 1000;
  before.ran = to_ms(facts.ran - before.facts.ran) / seconds;
  before.waited = to_ms(facts.waited - before.facts.waited) / seconds;
  const bool stayed = facts.processor == before.facts.processor;  // each one has a counter of its own
  before.withheld = stayed ? to_ms(facts.stolen - before.facts.stolen) / seconds : 0;
  if (whole_) return before;
  before.facts = facts;
  before.at = at;
  return before;
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
