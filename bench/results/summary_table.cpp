// SPDX-License-Identifier: Apache-2.0
#include "results/summary_table.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath {
namespace {

/// Three digits that mean something, whether the nodes work for 40 ms or not at all.
std::string number(double x) {
  if (!std::isfinite(x)) return "-";
  const double size = std::abs(x);
  const int decimals = size < 0.9995 ? 3 : size < 9.995 ? 2 : size < 999.5 ? 1 : 0;
  return fixed(x, decimals);
}

std::string number(const std::optional<Interval>& interval) {
  return interval ? "[" + number(interval->low) + "," + number(interval->high) + "]" : "";
}

enum class Form { plain, markdown };

bool beyond_noise(const std::optional<Estimate>& ratio) {
  return ratio && ratio->interval && (ratio->interval->high < 1 || ratio->interval->low > 1);
}

/// A terminal has no room for the interval of a ratio; a star says what it is for.
TextTable::Cell ratio_cell(const std::optional<Estimate>& ratio, Form form) {
  if (!ratio) return "-";
  if (form == Form::markdown) return {number(ratio->value), number(ratio->interval)};
  return number(ratio->value) + (beyond_noise(ratio) ? "*" : " ");
}

std::string chain_title(const Summary& summary, std::size_t chain) {
  const ChainSummary& first = summary.executors.front().chains[chain];
  std::string title = first.chain + ": hot-path latency in ms";
  const bool intervals = std::any_of(summary.executors.begin(), summary.executors.end(),
                                     [&](const auto& e) { return e.chains[chain].hot_path.p50.has_value(); });
  if (intervals) {
    title += text(" [%g %% interval over repetitions]", 100 * summary.bootstrap.confidence);
  }
  return title + (first.median_to_default ? ", ratios to default" : "");
}

TextTable chain_table(const Summary& summary, std::size_t chain, Form form) {
  TextTable table(chain_title(summary, chain),
                  {"executor", "n", "median", "p99", "p99.9", "max", "skipped", "over-\nwritten",
                   "CPU us/\ncallback", "median\nratio", "max\nratio"});
  for (const ExecutorSummary& e : summary.executors) {
    const ChainSummary& c = e.chains[chain];
    const LatencySummary& l = c.hot_path;
    table.add_row({e.executor,
                   std::to_string(l.quantiles.n),
                   {number(l.quantiles.p50), number(l.p50)},
                   {number(l.quantiles.p99), number(l.p99)},
                   {number(l.quantiles.p999), number(l.p999)},
                   {number(l.quantiles.max), number(l.max)},
                   std::to_string(e.skipped),
                   std::to_string(e.overwritten),
                   number(e.cpu_per_callback_us),
                   ratio_cell(c.median_to_default, form),
                   ratio_cell(c.max_to_default, form)});
  }
  return table;
}

double worst_response_ms(const ExecutorSummary& executor) {
  double worst = kNoValue;
  for (const TaskSummary& task : executor.tasks) worst = std::fmax(worst, task.response_ms.max);
  return worst;
}

/// NaN where the definition does not apply.
double worst_response_authors_ms(const ExecutorSummary& executor) {
  double worst = kNoValue;
  for (const TaskSummary& task : executor.tasks) {
    if (task.response_authors_ms) worst = std::fmax(worst, task.response_authors_ms->max);
  }
  return worst;
}

TextTable jobs_table(const Summary& summary) {
  TextTable table("jobs of all tasks",
                  {"executor", "callbacks\nexecuted", "skipped", "over-\nwritten", "CPU us/\ncallback",
                   "deadline\noverruns", "worst\nresponse ms", "as authors\ndefine it"});
  for (const ExecutorSummary& e : summary.executors) {
    table.add_row({e.executor, std::to_string(e.executed), std::to_string(e.skipped),
                   std::to_string(e.overwritten), number(e.cpu_per_callback_us),
                   std::to_string(e.after_warm_up.deadline_overruns), number(worst_response_ms(e)),
                   number(worst_response_authors_ms(e))});
  }
  return table;
}

std::vector<TextTable> tables(const Summary& summary, Form form) {
  if (summary.executors.empty()) return {};
  std::vector<TextTable> all;
  for (std::size_t chain = 0; chain < summary.executors.front().chains.size(); ++chain) {
    all.push_back(chain_table(summary, chain, form));
  }
  if (all.empty()) all.push_back(jobs_table(summary));
  return all;
}

/// Facts without which the numbers above could mislead, one sentence each.
std::vector<std::string> notes(const Summary& summary) {
  constexpr std::size_t kMostExamples = 3;
  std::vector<std::string> all;
  for (const ExecutorSummary& e : summary.executors) {
    for (std::size_t k = 0; k < std::min(kMostExamples, e.unbalanced.size()); ++k) {
      const Imbalance& i = e.unbalanced[k];
      all.push_back("Loss equation broken: " + e.executor + ", repetition " + std::to_string(i.repetition) +
                    ", " + i.task + ": " + std::to_string(i.accounted) + " accounted for, " +
                    std::to_string(i.expected) + " expected.");
    }
    if (e.unbalanced.size() > kMostExamples) {
      all.push_back("Loss equation broken: " + e.executor + ", " +
                    std::to_string(e.unbalanced.size() - kMostExamples) + " more, see summary.json.");
    }
    if (e.lost_records > 0) {
      all.push_back("Records lost: " + e.executor + " had no room for " + std::to_string(e.lost_records) +
                    " records.");
    }
    for (const ChainSummary& c : e.chains) {
      if (c.drops > 0) {
        all.push_back("Hot-path drops: " + e.executor + " lost " + std::to_string(c.drops) +
                      " samples on the way along " + c.chain + ".");
      }
    }
  }
  const bool balanced = std::all_of(summary.executors.begin(), summary.executors.end(),
                                    [](const ExecutorSummary& e) { return e.unbalanced.empty(); });
  if (balanced && !summary.executors.empty()) {
    all.insert(all.begin(), "Loss equations hold for every task of every run.");
  }
  return all;
}

bool any_beyond_noise(const Summary& summary) {
  for (const ExecutorSummary& e : summary.executors) {
    for (const ChainSummary& c : e.chains) {
      if (beyond_noise(c.median_to_default) || beyond_noise(c.max_to_default)) return true;
    }
  }
  return false;
}

}  // namespace

void write_table(std::ostream& out, const Summary& summary) {
  for (const TextTable& table : tables(summary, Form::plain)) out << table << '\n';
  if (any_beyond_noise(summary)) {
    out << "* beyond noise: the interval of this ratio to default, given in summary.json, leaves out 1.\n";
  }
  for (const std::string& note : notes(summary)) out << note << '\n';
}

void write_markdown_table(std::ostream& out, const Summary& summary) {
  for (const TextTable& table : tables(summary, Form::markdown)) {
    table.write_markdown(out);
    out << '\n';
  }
  for (const std::string& note : notes(summary)) out << note << '\n';
}

}  // namespace hotpath
