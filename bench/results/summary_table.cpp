// SPDX-License-Identifier: Apache-2.0
#include "results/summary_table.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "program/table.hpp"
#include "program/text.hpp"

namespace hotpath::results {
namespace {

/// Three significant digits for values below 1000, at most three decimals.
std::string number(double x) {
  if (!std::isfinite(x)) return "-";
  const double size = std::abs(x);
  const int decimals = size < 0.9995 ? 3 : size < 9.995 ? 2 : size < 999.5 ? 1 : 0;
  return program::fixed(x, decimals);
}

program::Value number(double x, const std::optional<Interval>& interval) {
  return {number(x), interval ? "[" + number(interval->low) + "," + number(interval->high) + "]" : ""};
}

bool beyond_noise(const std::optional<Estimate>& ratio) {
  return ratio && ratio->interval && (ratio->interval->high < 1 || ratio->interval->low > 1);
}

/// A star replaces the interval of a ratio, for which a terminal has no room.
std::string starred(const std::optional<Estimate>& ratio) {
  return ratio ? number(ratio->value) + (beyond_noise(ratio) ? "*" : " ") : "-";
}

std::string chain_title(const Summary& summary, std::size_t chain) {
  const ChainSummary& first = summary.executors.front().chains[chain];
  std::string title = first.chain + ": hot-path latency in ms";
  const auto has_intervals = [&](const auto& e) { return !std::isnan(e.chains[chain].hot_path.low.p50); };
  if (std::ranges::any_of(summary.executors, has_intervals)) {
    title += program::text(" [%g %% interval over repetitions]", 100 * summary.bootstrap.confidence);
  }
  return title + (first.median_to_default ? ", ratios to default" : "");
}

/// The row of an executor without results.
std::vector<program::Value> overloaded(const program::Table& table, const ExecutorSummary& e) {
  std::vector<program::Value> row = {e.executor, "overloaded"};
  row.resize(table.header.size(), "-");
  return row;
}

program::Table chain_table(const Summary& summary, std::size_t chain) {
  program::Table table(chain_title(summary, chain),
                       {"executor", "n", "median", "p99", "p99.9", "max", "skipped", "over-\nwritten",
                        "CPU us/\ncallback", "median\nratio", "max\nratio"});
  for (const ExecutorSummary& e : summary.executors) {
    const ChainSummary& c = e.chains[chain];
    const auto cell = [&](double Quantiles::*of) {
      const Estimate estimate = c.hot_path.estimate(of);
      return number(estimate.value, estimate.interval);
    };
    if (!e.overload.empty()) {
      table.add_row(overloaded(table, e));
      continue;
    }
    table.add_row({e.executor, c.hot_path.quantiles.n, cell(&Quantiles::p50), cell(&Quantiles::p99),
                   cell(&Quantiles::p999), cell(&Quantiles::max), e.skipped, e.overwritten,
                   number(e.cpu_per_callback_us), starred(c.median_to_default), starred(c.max_to_default)});
  }
  return table;
}

program::Table jobs_table(const Summary& summary) {
  program::Table table("jobs of all tasks",
                       {"executor", "callbacks\nexecuted", "skipped", "over-\nwritten", "CPU us/\ncallback",
                        "deadline\noverruns", "worst\nresponse ms", "as authors\ndefine it"});
  for (const ExecutorSummary& e : summary.executors) {
    if (!e.overload.empty()) {
      table.add_row(overloaded(table, e));
      continue;
    }
    double worst_ms = kNoValue, worst_authors_ms = kNoValue;  // the latter only in sets without subscriptions
    for (const TaskSummary& task : e.tasks) {
      worst_ms = std::fmax(worst_ms, task.response_ms.max);
      worst_authors_ms = std::fmax(worst_authors_ms, task.response_authors_ms.value_or(Quantiles()).max);
    }
    table.add_row({e.executor, e.executed, e.skipped, e.overwritten, number(e.cpu_per_callback_us),
                   e.after_warm_up.deadline_overruns, number(worst_ms), number(worst_authors_ms)});
  }
  return table;
}

/// Per executor the timer whose period varies most: upstream's third metric, for every timer.
void write_periods(std::ostream& out, const Summary& summary) {
  program::Table table("period of the timer that varies most, in ms from start to start",
                       {"executor", "timer", "period", "least", "greatest", "p99 off\nby"});
  bool any = false;
  for (const ExecutorSummary& e : summary.executors) {
    const TaskSummary* most = nullptr;
    for (const TaskSummary& task : e.tasks) {
      const double range = task.period_range_ms();
      if (std::isfinite(range) && (most == nullptr || range > most->period_range_ms())) most = &task;
    }
    if (most == nullptr) continue;
    any = true;
    table.add_row({e.executor, most->task, number(to_ms(most->period)), number(most->period_ms->min),
                   number(most->period_ms->max), number(most->period_deviation_ms->p99)});
  }
  if (any) out << table << '\n';
}

/// One sentence for each fact without which the numbers above could mislead.
void write_notes(std::ostream& out, const Summary& summary) {
  constexpr std::size_t kMostExamples = 3;
  const bool balanced =
      std::ranges::all_of(summary.executors, [](const ExecutorSummary& e) { return e.unbalanced.empty(); });
  if (balanced && !summary.executors.empty()) out << "Loss equations hold for every task of every run.\n";
  for (std::size_t c = 0; !summary.executors.empty() && c < summary.executors.front().chains.size(); ++c) {
    std::vector<std::string> most;
    for (const ExecutorSummary& e : summary.executors) {
      const Quantiles& whole = e.chains[c].end_to_end.quantiles;
      if (whole.n > 0) most.push_back(e.executor + " " + number(whole.max));
    }
    if (most.empty()) continue;
    out << "End to end along " << summary.executors.front().chains[c].chain
        << " at most: " << program::joined(most, ", ") << " ms.\n";
  }
  for (const ExecutorSummary& e : summary.executors) {
    for (const Imbalance& i : std::span(e.unbalanced).first(std::min(kMostExamples, e.unbalanced.size()))) {
      out << "Loss equation broken: " << e.executor << ", repetition " << i.repetition << ", " << i.task
          << ": " << i.accounted << " accounted for, " << i.expected << " expected.\n";
    }
    if (e.unbalanced.size() > kMostExamples) {
      out << "Loss equation broken: " << e.executor << ", " << e.unbalanced.size() - kMostExamples
          << " more, see summary.json.\n";
    }
    if (e.lost_records > 0) {
      out << "Records lost: " << e.executor << " had no room for " << e.lost_records << " records.\n";
    }
    for (const ChainSummary& c : e.chains) {
      if (c.drops == 0) continue;
      out << "Hot-path drops: " << e.executor << " lost " << c.drops << " samples along " << c.chain << ".\n";
    }
  }
}

/// A line for each disturbed repetition.
void write_disturbed(std::ostream& out, const ExecutorSummary& e) {
  constexpr std::size_t kMostLines = 5;
  for (const DisturbedRepetition& r :
       std::span(e.disturbed).first(std::min(kMostLines, e.disturbed.size()))) {
    out << "Disturbed: " << e.executor << ", repetition " << r.repetition << ": " << program::joined(r.marks)
        << ".\n";
  }
  if (e.disturbed.size() > kMostLines) {
    out << "Disturbed: " << e.executor << ", " << e.disturbed.size() - kMostLines
        << " more repetitions, see summary.json.\n";
  }
}

/// A line for each task that starved, and for each timer that waited longer than its period, the worst first.
void write_starved(std::ostream& out, const ExecutorSummary& e) {
  constexpr std::size_t kMostLines = 10;
  std::vector<std::string> lines = starved(e);
  std::vector<const TaskSummary*> late;
  for (const TaskSummary& task : e.tasks) {
    if (!task.starved() && task.late()) late.push_back(&task);
  }
  const auto severity = [](const TaskSummary* task) {
    return to_ms(task->longest_wait) / to_ms(task->period);
  };
  std::ranges::stable_sort(late, std::greater(), severity);
  for (const TaskSummary* task : late)
    lines.push_back(program::concat(task->task, " waited up to ", number(to_ms(task->longest_wait)),
                                    " ms (period ", to_ms(task->period), " ms)"));
  for (const std::string& line : std::span(lines).first(std::min(kMostLines, lines.size())))
    out << e.executor << ": " << line << "\n";
  if (lines.size() > kMostLines) {
    out << e.executor << ": and " << lines.size() - kMostLines << " more, see summary.json\n";
  }
}

bool any_beyond_noise(const Summary& summary) {
  return std::ranges::any_of(summary.executors, [](const ExecutorSummary& e) {
    return std::ranges::any_of(e.chains, [](const ChainSummary& c) {
      return beyond_noise(c.median_to_default) || beyond_noise(c.max_to_default);
    });
  });
}

}  // namespace

std::vector<std::string> starved(const ExecutorSummary& executor) {
  std::vector<std::string> all;
  for (const TaskSummary& t : executor.tasks) {
    const std::string ran =
        program::concat(" ran ", t.account[Outcome::ran], " of ", t.account.accounted(), " times");
    if (t.starved()) all.push_back(t.task + (t.never_ran() ? " never ran" : ran));
  }
  return all;
}

void write_table(std::ostream& out, const Summary& summary) {
  const std::size_t chains = summary.executors.empty() ? 0 : summary.executors.front().chains.size();
  for (std::size_t chain = 0; chain < chains; ++chain) out << chain_table(summary, chain) << '\n';
  if (chains == 0 && !summary.executors.empty()) out << jobs_table(summary) << '\n';
  write_periods(out, summary);
  if (any_beyond_noise(summary)) {
    out << "* beyond noise: the confidence interval of this ratio to default (summary.json) excludes 1.\n";
  }
  for (const ExecutorSummary& e : summary.executors) {
    if (!e.overload.empty()) out << e.executor << ": " << e.overload << "\n";
    write_starved(out, e);
  }
  for (const ExecutorSummary& e : summary.executors) write_disturbed(out, e);
  write_notes(out, summary);
}

}  // namespace hotpath::results
