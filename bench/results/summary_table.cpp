// SPDX-License-Identifier: Apache-2.0
#include "results/summary_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <string>
#include <vector>

namespace hotpath {
namespace {

struct Cell {
  std::string value;
  std::string interval;  ///< Empty: none.
};

struct Column {
  std::array<std::string, 2> header;  ///< Upper and lower line.
  std::vector<Cell> cells;
};

struct Table {
  std::string title;
  std::vector<Column> columns;
};

/// Three digits that mean something, whether the nodes work for 40 ms or not at all.
std::string number(double x) {
  if (!std::isfinite(x)) return "-";
  const double size = std::abs(x);
  const int decimals = size < 0.9995 ? 3 : size < 9.995 ? 2 : size < 999.5 ? 1 : 0;
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%.*f", decimals, x);
  return text.data();
}

std::string number(const std::optional<Interval>& interval) {
  return interval ? "[" + number(interval->low) + "," + number(interval->high) + "]" : "";
}

enum class Form { plain, markdown };

bool beyond_noise(const std::optional<Estimate>& ratio) {
  return ratio && ratio->interval && (ratio->interval->high < 1 || ratio->interval->low > 1);
}

/// A terminal has no room for the interval of a ratio; a star says what it is for.
Cell ratio_cell(const std::optional<Estimate>& ratio, Form form) {
  if (!ratio) return {"-", ""};
  if (form == Form::markdown) return {number(ratio->value), number(ratio->interval)};
  return {number(ratio->value) + (beyond_noise(ratio) ? "*" : " "), ""};
}

template <class GetCell>
Column column(const Summary& summary, std::string upper, std::string lower, GetCell cell) {
  Column c{{std::move(upper), std::move(lower)}, {}};
  for (const ExecutorSummary& executor : summary.executors) c.cells.push_back(cell(executor));
  return c;
}

template <class GetCount>
Column counts(const Summary& summary, std::string upper, std::string lower, GetCount count) {
  return column(summary, std::move(upper), std::move(lower), [&](const ExecutorSummary& e) {
    return Cell{std::to_string(count(e)), ""};
  });
}

Column names(const Summary& summary) {
  return column(summary, "", "executor", [](const ExecutorSummary& e) { return Cell{e.executor, ""}; });
}

void append_costs(const Summary& summary, std::vector<Column>& columns) {
  columns.push_back(counts(summary, "", "skipped", [](const auto& e) { return e.skipped; }));
  columns.push_back(counts(summary, "over-", "written", [](const auto& e) { return e.overwritten; }));
  columns.push_back(column(summary, "CPU us/", "callback", [](const auto& e) {
    return Cell{number(e.cpu_per_callback_us), ""};
  }));
}

Table chain_table(const Summary& summary, std::size_t chain, Form form) {
  std::string title = summary.executors.front().chains[chain].chain + ": hot-path latency in ms";
  const bool intervals = std::any_of(summary.executors.begin(), summary.executors.end(),
                                     [&](const auto& e) { return e.chains[chain].hot_path.p50.has_value(); });
  if (intervals) {
    std::array<char, 32> percent;
    std::snprintf(percent.data(), percent.size(), "%g", 100 * summary.bootstrap.confidence);
    title += std::string(" [") + percent.data() + " % interval over repetitions]";
  }
  if (summary.executors.front().chains[chain].median_to_default) title += ", ratios to default";
  Table table{std::move(title), {names(summary)}};
  auto& columns = table.columns;
  const auto latency = [&](std::string name, double Quantiles::*value,
                           std::optional<Interval> LatencySummary::*interval) {
    columns.push_back(column(summary, "", std::move(name), [&](const ExecutorSummary& e) {
      const LatencySummary& l = e.chains[chain].hot_path;
      return Cell{number(l.quantiles.*value), number(l.*interval)};
    }));
  };
  columns.push_back(
      counts(summary, "", "n", [&](const auto& e) { return e.chains[chain].hot_path.quantiles.n; }));
  latency("median", &Quantiles::p50, &LatencySummary::p50);
  latency("p99", &Quantiles::p99, &LatencySummary::p99);
  latency("p99.9", &Quantiles::p999, &LatencySummary::p999);
  latency("max", &Quantiles::max, &LatencySummary::max);
  append_costs(summary, columns);
  columns.push_back(column(summary, "median", "ratio", [&](const auto& e) {
    return ratio_cell(e.chains[chain].median_to_default, form);
  }));
  columns.push_back(column(summary, "max", "ratio",
                           [&](const auto& e) { return ratio_cell(e.chains[chain].max_to_default, form); }));
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

Table jobs_table(const Summary& summary) {
  Table table{"jobs of all tasks", {names(summary)}};
  auto& columns = table.columns;
  columns.push_back(counts(summary, "callbacks", "executed", [](const auto& e) { return e.executed; }));
  append_costs(summary, columns);
  columns.push_back(counts(summary, "deadline", "overruns",
                           [](const auto& e) { return e.after_warm_up.deadline_overruns; }));
  columns.push_back(column(summary, "worst", "response ms", [](const auto& e) {
    return Cell{number(worst_response_ms(e)), ""};
  }));
  columns.push_back(column(summary, "as authors", "define it", [](const auto& e) {
    return Cell{number(worst_response_authors_ms(e)), ""};
  }));
  return table;
}

std::vector<Table> tables(const Summary& summary, Form form) {
  if (summary.executors.empty()) return {};
  std::vector<Table> all;
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

std::size_t width(const Column& column) {
  std::size_t widest = std::max(column.header[0].size(), column.header[1].size());
  for (const Cell& cell : column.cells) {
    widest = std::max({widest, cell.value.size(), cell.interval.size()});
  }
  return widest;
}

/// Names stand left, numbers right.
template <class GetText>
void write_line(std::ostream& out, const Table& table, GetText text) {
  std::string line;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const std::string& content = text(table.columns[c]);
    const std::string padding(width(table.columns[c]) - content.size(), ' ');
    line += c == 0 ? content + padding : "  " + padding + content;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  out << line << '\n';
}

void write_plain(std::ostream& out, const Table& table) {
  out << table.title << "\n\n";
  for (std::size_t h = 0; h < 2; ++h) {
    write_line(out, table, [&](const Column& c) -> const std::string& { return c.header[h]; });
  }
  std::size_t total = 2 * (table.columns.size() - 1);
  for (const Column& c : table.columns) total += width(c);
  out << std::string(total, '-') << '\n';
  for (std::size_t row = 0; row < table.columns.front().cells.size(); ++row) {
    write_line(out, table, [&](const Column& c) -> const std::string& { return c.cells[row].value; });
    const bool intervals = std::any_of(table.columns.begin(), table.columns.end(),
                                       [&](const Column& c) { return !c.cells[row].interval.empty(); });
    if (!intervals) continue;
    write_line(out, table, [&](const Column& c) -> const std::string& { return c.cells[row].interval; });
  }
}

/// `over-` and `written` are one word, `CPU us/` and `callback` one fraction, the rest two words.
std::string one_line(const Column& column) {
  const auto& [upper, lower] = column.header;
  if (upper.empty()) return lower;
  if (upper.back() == '-') return upper.substr(0, upper.size() - 1) + lower;
  return upper.back() == '/' ? upper + lower : upper + " " + lower;
}

void write_markdown(std::ostream& out, const Table& table) {
  out << "**" << table.title << "**\n\n";
  for (const Column& c : table.columns) out << "| " << one_line(c) << ' ';
  out << "|\n";
  for (std::size_t c = 0; c < table.columns.size(); ++c) out << (c == 0 ? "| --- " : "| ---: ");
  out << "|\n";
  for (std::size_t row = 0; row < table.columns.front().cells.size(); ++row) {
    for (const Column& c : table.columns) {
      const Cell& cell = c.cells[row];
      out << "| " << (cell.interval.empty() ? cell.value : cell.value + " " + cell.interval) << ' ';
    }
    out << "|\n";
  }
}

}  // namespace

void write_table(std::ostream& out, const Summary& summary) {
  for (const Table& table : tables(summary, Form::plain)) {
    write_plain(out, table);
    out << '\n';
  }
  if (any_beyond_noise(summary)) {
    out << "* beyond noise: the interval of this ratio to default, given in summary.json, leaves out 1.\n";
  }
  for (const std::string& note : notes(summary)) out << note << '\n';
}

void write_markdown_table(std::ostream& out, const Summary& summary) {
  for (const Table& table : tables(summary, Form::markdown)) {
    write_markdown(out, table);
    out << '\n';
  }
  for (const std::string& note : notes(summary)) out << note << '\n';
}

}  // namespace hotpath
