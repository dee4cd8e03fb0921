// SPDX-License-Identifier: Apache-2.0
#include "guarantees/analyze.hpp"

#include <algorithm>
#include <map>
#include <ostream>

#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath::guarantees {

namespace {

using program::Column;

/// Nanoseconds as milliseconds; `-` for none.
std::string in_ms(std::optional<std::int64_t> ns) {
  return ns ? program::fixed(to_ms(Duration(*ns)), 3) : "-";
}

/// Whether the bound is another one with kSomeDelivery.
bool depends_on_delivery(const BoundRow& row) {
  constexpr Duration kItself = 1000 * kSomeDelivery;  // a path of that many samples
  return row.bound_ns && row.delivered_ns && *row.delivered_ns > *row.bound_ns + kItself.count();
}

/// Observed / bound.
std::optional<double> tightness(const BoundRow& row) {
  if (!row.observed_ns || row.bound_ns.value_or(0) <= 0) return std::nullopt;
  return static_cast<double>(*row.observed_ns) / static_cast<double>(*row.bound_ns);
}

std::string consists_of(const PathParts& parts, const TaskSet& set) {
  constexpr std::size_t kMost = 5;
  std::string out;
  if (parts.blocking > 0) {
    const bool job = parts.blocker != kNoTask;
    out = in_ms(parts.blocking) + (job ? " blocked by " + set[parts.blocker].name : " waking up") + "; ";
  }
  for (std::size_t i = 0; i < std::min(kMost, parts.work.size()); ++i)
    out += (i > 0 ? "; " : "") + in_ms(parts.work[i].second) + " " + set[parts.work[i].first].name;
  return out + (parts.work.size() > kMost ? "; ..." : "");
}

void add_parts(BoundRow& row, const ChainAge& age, const TaskSet& set) {
  row.last_timer = "-";
  if (age.last_timer == kNoTask) return;
  row.last_timer = set[age.last_timer].name;
  row.response_ns = age.response;
  row.waiting_ns = age.waiting;
  if (age.waited_at != kNoTask)
    row.dominated_by = in_ms(age.waiting) + " ms waiting at " + set[age.waited_at].name + "; ";
  row.dominated_by += in_ms(age.response) + " ms behind " + row.last_timer + "'s timestamp";
  if (!age.parts.work.empty()) row.dominated_by += ": " + consists_of(age.parts, set);
}

/// The columns of a printed table.
std::vector<Column<BoundRow>> shown_columns(Latency latency, bool compared,
                                            const std::vector<BoundRow>& rows) {
  const results::LatencyWords& words = results::words_of(latency);
  const bool of_task = latency == Latency::response;
  std::vector<Column<BoundRow>> columns = {
      {of_task ? words.kind : program::concat("chain, ", words.bound), &BoundRow::name}};
  const auto add_ms = [&](const char* name, std::optional<std::int64_t> BoundRow::*member) {
    columns.emplace_back(name, [member](const BoundRow& row) { return in_ms(row.*member); });
  };
  add_ms("bound ms", &BoundRow::bound_ns);
  if (of_task) {
    columns.emplace_back("deadline", [](const BoundRow& row) {
      return row.deadline_ns ? in_ms(row.deadline_ns) : std::string();
    });
  } else if (latency == Latency::age) {
    add_ms("response", &BoundRow::response_ns);
    add_ms("waiting", &BoundRow::waiting_ns);
    columns.emplace_back("last timer", &BoundRow::last_timer);
  }
  if (std::ranges::any_of(rows, depends_on_delivery)) add_ms("with delivery", &BoundRow::delivered_ns);
  if (!compared) return columns;
  add_ms("observed ms", &BoundRow::observed_ns);
  columns.emplace_back("tightness", [](const BoundRow& row) {
    const std::optional<double> value = tightness(row);
    return value ? program::fixed(*value, 3) : "-";
  });
  columns.emplace_back("", [](const BoundRow& row) { return row.violated() ? "VIOLATED" : ""; });
  return columns;
}

void print_verdict(std::ostream& out, const std::vector<BoundRow>& tasks) {
  const auto late = std::ranges::find_if(tasks, [](const BoundRow& row) {
    return row.deadline_ns && (!row.bound_ns || *row.bound_ns > *row.deadline_ns);
  });
  out << (late == tasks.end() ? "Schedulable: every timer meets its deadline.\n"
                              : "Schedulability not shown: " + late->name + " may exceed its deadline.\n");
}

}  // namespace

const std::vector<Column<BoundRow>>& bound_columns() {
  static const std::vector<Column<BoundRow>> columns = {
      {"executor", &BoundRow::executor},
      {"method", &BoundRow::method},
      {"kind", [](const BoundRow& row) { return results::words_of(row.latency).kind; }},
      {"name", &BoundRow::name},
      {"bound_ns", &BoundRow::bound_ns},
      {"observed_ns", &BoundRow::observed_ns},
      {"tightness", tightness},
      {"violated", [](const BoundRow& row) { return row.violated() ? "yes" : "no"; }},
      {"deadline_ns", &BoundRow::deadline_ns},
      {"response_ns", &BoundRow::response_ns},
      {"waiting_ns", &BoundRow::waiting_ns},
      {"dominated_by", &BoundRow::dominated_by},
      {"utilisation_percent", &BoundRow::utilisation_percent},
      {"delivered_ns", &BoundRow::delivered_ns},
      {"rests_on", &BoundRow::rests_on},
      {"assumed", &BoundRow::assumed}};
  return columns;
}

std::vector<BoundRow> bound_rows(const BoundRow& common, const CallbackGraph& graph,
                                 const GraphBounds& bounds) {
  std::vector<BoundRow> rows;
  const auto add = [&](Latency latency, const std::string& name, std::optional<std::int64_t> bound) {
    BoundRow& row = rows.emplace_back(common);
    row.method = bounds.method;
    row.latency = latency;
    row.name = name;
    row.bound_ns = bound;
  };
  for (TaskId id = 0; id < graph.set.size(); ++id) {
    const Task& task = graph.set[id];
    add(Latency::response, task.name, bounds.tasks[id]);
    if (task.kind == TaskKind::timer) rows.back().deadline_ns = task.deadline.count();
    if (bounds.parts.contains(id)) rows.back().dominated_by = consists_of(bounds.parts.at(id), graph.set);
  }
  for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
    const std::optional<ChainAge>& age = bounds.chains[c];
    add(Latency::age, graph.chains[c].name, age ? std::optional(age->latency) : std::nullopt);
    age ? add_parts(rows.back(), *age, graph.set) : void(rows.back().last_timer = bounds.no_chain_bound[c]);
  }
  const auto hot_path_of = [](const std::optional<ChainAge>& age) {
    return age ? age->hot_path : std::nullopt;
  };
  const bool any =
      std::ranges::any_of(bounds.chains, [&](const auto& age) { return hot_path_of(age).has_value(); });
  for (std::size_t c = 0; any && c < bounds.chains.size(); ++c)
    add(Latency::hot_path, graph.chains[c].name, hot_path_of(bounds.chains[c]));
  return rows;
}

Observed::Observed(results::StoredRun& run, const TaskSet& set) {
  run.load(set);
  for (const Trace& trace : run.traces()) {
    const auto keep = [&](Latency latency, const std::string& name, Duration value) {
      values_[{latency, trace.executor, name}].push_back(value.count());
    };
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome == Outcome::ran) keep(Latency::response, set[r.job.task].name, r.response_time());
    }
    for (const ChainRecord& c : trace.chains) {
      for (const Latency latency : {Latency::age, Latency::hot_path})
        if (const auto value = c.latency(latency)) keep(latency, run.chains()[c.chain], *value);
    }
  }
}

const std::vector<std::int64_t>& Observed::of(Latency latency, const std::string& executor,
                                              const std::string& name) const {
  static const std::vector<std::int64_t> none;
  const auto entry = values_.find({latency, executor, name});
  return entry == values_.end() ? none : entry->second;
}

void Observed::compare(BoundRow& row) {
  const std::vector<std::int64_t>& values = of(row.latency, row.executor, row.name);
  if (values.empty()) return;
  row.observed_ns = std::ranges::max(values);
  if (!row.bound_ns) return;
  compared += values.size();
  if (row.violated() && violations == 0) {
    first_violation = program::concat(results::words_of(row.latency).kind, " ", row.name, " under ",
                                      row.executor, " by ", row.method);
  }
  violations += static_cast<std::size_t>(
      std::ranges::count_if(values, [&](std::int64_t value) { return value > *row.bound_ns; }));
}

void print(std::ostream& out, const std::vector<BoundRow>& rows, bool compared) {
  for (const Latency latency : {Latency::response, Latency::age, Latency::hot_path}) {
    std::vector<BoundRow> shown;
    std::ranges::copy_if(rows, std::back_inserter(shown),
                         [&](const BoundRow& r) { return r.latency == latency; });
    if (shown.empty() && latency != Latency::response) continue;
    out << program::table_of(shown_columns(latency, compared, shown), shown);
    if (latency == Latency::response) print_verdict(out, shown);
  }
  for (const BoundRow& row : rows) {
    if (row.latency == Latency::age && !row.dominated_by.empty())
      out << row.name << ": " << row.dominated_by << "\n";
  }
}

std::vector<std::string> verdict(const std::vector<BoundRow>& rows,
                                 const std::vector<std::string>& executors) {
  std::map<std::string, std::map<std::string, const BoundRow*>> smallest;  // by chain and executor
  for (const BoundRow& row : rows) {
    if (row.latency != Latency::age || !row.bound_ns) continue;
    const BoundRow*& least = smallest[row.name][row.executor];
    if (least == nullptr || row.bound_ns < least->bound_ns) least = &row;
  }
  std::vector<std::string> sentences;
  for (const auto& [chain, by_executor] : smallest) {
    std::vector<const BoundRow*> bounded;
    std::vector<std::string> values, delivered, unbounded;
    for (const std::string& executor : executors) {
      const auto row = by_executor.find(executor);
      row == by_executor.end() ? unbounded.push_back(executor) : bounded.push_back(row->second);
    }
    std::ranges::stable_sort(bounded, {}, &BoundRow::bound_ns);
    for (const BoundRow* row : bounded) {
      values.push_back(in_ms(row->bound_ns) + " ms under " + row->executor);
      if (depends_on_delivery(*row))
        delivered.push_back(in_ms(row->delivered_ns) + " ms under " + row->executor);
    }
    sentences.push_back(
        program::concat(chain, ": the data is never older than ", program::joined(values),
                        unbounded.empty() ? "" : "; no bound under " + program::joined(unbounded), ".",
                        delivered.empty() ? ""
                                          : " If samples take any time to arrive, as between processes: " +
                                                program::joined(delivered) + "."));
  }
  return sentences;
}

}  // namespace hotpath::guarantees
