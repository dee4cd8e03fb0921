// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::results {
namespace {

using program::concat;

constexpr const char* kHotPath =
    "from the start of\nthe latest source's callback to the start of the last one (the paper's metric)";

/// A latency in milliseconds, a ratio or another measure for people: three digits, at most three decimals;
/// `-`: unknown.
std::string shown_number(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  const int decimals = size < 0.9995 ? 3 : size < 9.995 ? 2 : size < 999.5 ? 1 : 0;
  return program::fixed(value, decimals);
}

/// A ratio as difference in percent: `-25 %`.
std::string shown_difference(double ratio) {
  const double percent = std::round(100 * (ratio - 1));
  return percent == 0 ? "0 %" : program::text("%+.0f %%", percent);
}

bool beyond_noise(const std::optional<Estimate>& ratio) { return ratio && ratio->excludes(1); }

/// A quantile with its difference to `default`, if that was measured, and its interval below. A star: beyond
/// noise.
program::Value cell(const LatencySummary& latency, Judged which, bool compared = true) {
  const auto& [value, interval] = latency.estimate(traits_of(which).of);
  const std::optional<Estimate> ratio = compared ? latency.to_default[which] : std::nullopt;
  std::string shown = shown_number(value);
  if (ratio && ratio->value != 1) shown += " (" + shown_difference(ratio->value) + ")";
  if (beyond_noise(ratio)) shown += "*";
  return {shown,
          interval ? "[" + shown_number(interval->low) + "," + shown_number(interval->high) + "]" : ""};
}

std::string chain_title(const Summary& summary, std::size_t chain) {
  bool has_interval = false, is_compared = false;
  for (const ExecutorSummary& e : summary.executors) {
    has_interval |= !std::isnan(e.chains[chain].end_to_end.low.p50);
    is_compared |= e.chains[chain].end_to_end.to_default[kMedian].has_value();
  }
  std::string title =
      summary.executors.front().chains[chain].chain + ": age of the data in each output, in ms";
  if (has_interval)
    title += program::text(" [%g %% interval over repetitions]", 100 * summary.bootstrap.confidence);
  return title + (is_compared && summary.executors.size() > 1 ? " (difference to default)" : "");
}

/// Adds the row of an executor, which may have no results.
void add_row(program::Table& table, const ExecutorSummary& e, std::vector<program::Value> cells) {
  if (!e.overload.empty()) {
    cells = {e.executor, "overloaded"};
    cells.resize(table.header.size(), "-");
  }
  table.add_row(std::move(cells));
}

program::Table chain_table(const Summary& summary, std::size_t chain) {
  program::Table table(chain_title(summary, chain),
                       {"executor", "median", "p99", "worst", "hot path,\nworst", "lost"});
  for (const ExecutorSummary& e : summary.executors) {
    const LatencySummary &age = e.chains[chain].end_to_end, &hot_path = e.chains[chain].hot_path;
    add_row(table, e,
            {e.executor, cell(age, kMedian), cell(age, kP99), cell(age, kWorst), cell(hot_path, kWorst),
             e.lost()});
  }
  return table;
}

/// What else users ask of the outputs of a chain; `whole`: with what chain_table() has of the hot path.
program::Table outputs_table(const Summary& summary, std::size_t chain, bool whole) {
  program::Table table("outputs of " + summary.executors.front().chains[chain].chain + ", in ms",
                       {"executor", "outputs", "median\ninterval", "longest\ngap", "disparity,\nworst",
                        "hot path,\nmedian", "hot path,\np99"});
  if (whole) {
    table.header.emplace_back("hot path,\nworst");
    table.title +=
        concat("; hot path: ", kHotPath, "; in parentheses the difference to default (*: beyond noise)");
  }
  for (const ExecutorSummary& e : summary.executors) {
    const ChainSummary& c = e.chains[chain];
    if (!e.overload.empty()) continue;
    table.add_row({e.executor, c.hot_path.quantiles.n, shown_number(c.interval_ms.p50),
                   shown_number(c.interval_ms.max), shown_number(c.disparity_ms.max),
                   cell(c.hot_path, kMedian), cell(c.hot_path, kP99, false)});
    if (whole) table.rows.back().push_back(cell(c.hot_path, kWorst));
  }
  return table;
}

program::Table jobs_table(const Summary& summary) {
  program::Table table("jobs of all tasks",
                       {"executor", "callbacks\nexecuted", "skipped", "over-\nwritten", "CPU us/\ncallback",
                        "deadline\noverruns", "worst\nresponse ms", "as authors\ndefine it"});
  for (const ExecutorSummary& e : summary.executors)
    add_row(table, e,
            {e.executor, e.executed, e.skipped, e.overwritten, shown_number(e.cpu_per_callback_us),
             e.after_warm_up.deadline_overruns, shown_number(e.worst(&TaskSummary::response_ms)),
             shown_number(e.worst(&TaskSummary::response_authors_ms))});
  return table;
}

/// The tasks that lost timestamps or samples.
program::Table losses_table(const Summary& summary) {
  program::Table table("losses by task",
                       {"executor", "task", "jobs", "skipped", "overwritten", "queued at the end"});
  for (const ExecutorSummary& e : summary.executors) {
    for (const TaskSummary& task : e.tasks) {
      const TaskAccount& of = task.account;
      if (of[Outcome::skipped] + of[Outcome::overwritten] > 0)
        table.add_row({e.executor, task.task, of[Outcome::ran], of[Outcome::skipped],
                       of[Outcome::overwritten], of[Outcome::queued]});
    }
  }
  return table;
}

/// Upstream's third metric, for every timer or only for that of each executor whose period varies most.
program::Table periods_table(const Summary& summary, bool all) {
  program::Table table(program::concat(all ? "periods of timers" : "period of the timer that varies most",
                                       ", in ms from start to start"),
                       {"executor", "timer", "period", "least", "greatest", "p99 off\nby"});
  for (const ExecutorSummary& e : summary.executors) {
    std::vector<const TaskSummary*> timers;
    for (const TaskSummary& task : e.tasks)
      if (std::isfinite(task.period_range_ms())) timers.push_back(&task);
    if (!all && !timers.empty())
      timers = {*std::ranges::max_element(timers, {}, &TaskSummary::period_range_ms)};
    for (const TaskSummary* task : timers)
      table.add_row({e.executor, task->task, shown_number(to_ms(task->period)),
                     shown_number(task->period_ms.min), shown_number(task->period_ms.max),
                     shown_number(task->period_deviation_ms.p99)});
  }
  return table;
}

program::Table disturbed_table(const Summary& summary) {
  program::Table table("disturbed repetitions", {"executor", "repetition", "marks"});
  for (const ExecutorSummary& e : summary.executors)
    for (const auto& [repetition, marks] : e.disturbed)
      table.add_row({e.executor, repetition, program::joined(marks, "; ")});
  return table;
}

/// The first lines, each after `start`, and how many more there are.
void write_first(std::ostream& out, const std::string& start, const std::vector<std::string>& lines,
                 std::size_t most, const char* more) {
  for (const std::string& line : std::span(lines).first(std::min(most, lines.size())))
    out << start << line << "\n";
  if (lines.size() > most) out << start << program::text(more, lines.size() - most) << "\n";
}

/// A line for each fact without which the numbers above could mislead.
void write_notes(std::ostream& out, const ExecutorSummary& e) {
  std::vector<std::string> unbalanced;
  for (const auto& [repetition, task, accounted, expected] : e.unbalanced)
    unbalanced.push_back(concat("repetition ", repetition, ", ", task, ": ", accounted, " accounted for, ",
                                expected, " expected."));
  write_first(out, "Loss equation broken: " + e.executor + ", ", unbalanced, 3,
              "%zu more, see summary.json.");
  if (e.lost_records > 0)
    out << "Records lost: " << e.executor << " had no room for " << e.lost_records << " records.\n";
  for (const ChainSummary& c : e.chains) {
    if (c.drops == 0) continue;
    out << e.executor << " replaced " << c.drops << " samples along " << c.chain
        << " by newer ones before they were read (hot-path drops; normal where rates differ).\n";
  }
}

/// A line for each disturbed repetition.
void write_disturbed(std::ostream& out, const ExecutorSummary& e) {
  std::vector<std::string> lines;
  for (const auto& [repetition, marks] : e.disturbed)
    lines.push_back(concat("repetition ", repetition, ": ", program::joined(marks), "."));
  write_first(out, "Disturbed: " + e.executor + ", ", lines, 5, "%zu more repetitions, see summary.json.");
}

/// A line for each task that starved or never ran, and for each timer that waited longer than its period, the
/// worst first.
void write_starved(std::ostream& out, const ExecutorSummary& e) {
  std::vector<std::string> lines = starved(e);
  std::vector<const TaskSummary*> late;
  for (const TaskSummary& task : e.tasks) {
    if (task.starved() || !task.late()) continue;
    task.never_ran() ? lines.push_back(task.task + " never ran") : late.push_back(&task);
  }
  const auto severity = [](const TaskSummary* task) {
    return to_ms(task->longest_wait) / to_ms(task->period);
  };
  std::ranges::stable_sort(late, std::greater(), severity);
  for (const TaskSummary* task : late)
    lines.push_back(concat(task->task, " waited up to ", shown_number(to_ms(task->longest_wait)),
                           " ms (period ", to_ms(task->period), " ms)"));
  write_first(out, e.executor + ": ", lines, 10, "and %zu more, see summary.json");
}

bool any_beyond_noise(const Summary& summary) {
  return std::ranges::any_of(summary.executors, [](const ExecutorSummary& e) {
    return std::ranges::any_of(e.chains, [](const ChainSummary& c) {
      return std::ranges::any_of(c.end_to_end.to_default, beyond_noise) ||
             beyond_noise(c.hot_path.to_default[kWorst]);
    });
  });
}

/// An executor's results for one chain.
struct Candidate {
  const ExecutorSummary* executor;
  const LatencySummary* age;

  [[nodiscard]] double p99() const { return age->quantiles.p99; }
  [[nodiscard]] const std::string& name() const { return executor->executor; }
};

std::vector<Candidate> candidates(const Summary& summary, std::size_t chain) {
  std::size_t most = 0;
  for (const ExecutorSummary& e : summary.executors)
    if (e.overload.empty()) most = std::max(most, e.chains[chain].end_to_end.quantiles.n);
  std::vector<Candidate> found;
  for (const ExecutorSummary& e : summary.executors) {
    const LatencySummary& age = e.chains[chain].end_to_end;
    const bool enough = age.quantiles.n > 0 && 20 * age.quantiles.n >= 19 * most;
    if (e.overload.empty() && enough && starved(e).empty()) found.push_back({&e, &age});
  }
  std::ranges::stable_sort(found, {}, &Candidate::p99);
  return found;
}

/// What the winner costs compared with the baseline.
std::string price(const Candidate& winner, const Candidate& baseline) {
  std::vector<std::string> prices;
  const ExecutorSummary &own = *winner.executor, &other = *baseline.executor;
  if (own.lost() > other.lost())
    prices.push_back(concat("it loses ", own.lost(), " timestamps and samples instead of ", other.lost()));
  const auto off_period_ms = [](const TaskSummary& task) {
    return task.period_deviation_ms.n == 0 ? -1 : task.period_deviation_ms.p99;
  };
  const auto timer = std::ranges::max_element(own.tasks, {}, off_period_ms);
  if (timer != own.tasks.end()) {
    const auto same = std::ranges::find(other.tasks, timer->task, &TaskSummary::task);
    const double before = same == other.tasks.end() ? kNoValue : same->period_deviation_ms.p99;
    if (timer->period_deviation_ms.p99 > 1.5 * before)
      prices.push_back(concat(timer->task, " starts up to ", shown_number(timer->period_deviation_ms.p99),
                              " ms off its period instead of ", shown_number(before)));
  }
  const ExecutorEntry* const entry = find_executor(ExecutorLabel(winner.name()).name);
  if (entry != nullptr && entry->traits.timers == TimerHandling::release_and_execute)
    prices.emplace_back("timers' callbacks run in a second thread, so they must share no data unlocked");
  return prices.empty() ? "" : " Price: " + program::joined(prices, "; ") + ".";
}

/// `to_default`: the sentence before names default. `alone`: there is no other; it may be a recording.
std::string certainty(const Candidate& winner, bool to_default, bool alone = false) {
  const bool simulated = winner.executor->usage.wall == Duration{};
  const std::optional<Estimate>& ratio = winner.age->to_default[kP99];
  if (to_default && ratio && ratio->interval)
    return concat(simulated ? " Simulated" : " Measured", ": between ",
                  shown_difference(ratio->interval->low), " and ", shown_difference(ratio->interval->high),
                  beyond_noise(ratio) ? "." : ", so not beyond noise.");
  const std::size_t repetitions = winner.executor->repetitions;
  if (alone && simulated && repetitions == 1) return " For one set of phases and execution times.";
  if (repetitions > 1)
    return concat(simulated ? " Simulated, " : " Measured, ", repetitions, " repetitions.");
  return simulated ? " Simulated, for one set of phases and execution times: others can reverse it."
                   : " Measured once: repeat it to know the noise.";
}

std::string sentence(const std::string& chain, const std::vector<Candidate>& all) {
  const Candidate& best = all.front();
  const std::string youngest = concat(chain, ": the data is youngest under ", best.name(), ": at most ",
                                      shown_number(best.p99()), " ms old in 99 of 100 outputs");
  if (all.size() == 1) {
    const std::uint64_t lost = best.executor->lost();
    return concat(chain, ": under ", best.name(), ", half of the outputs use data that is at most ",
                  shown_number(best.age->quantiles.p50), " ms old, 99 of 100 at most ",
                  shown_number(best.p99()), ".",
                  lost == 0 ? "" : concat(" It loses ", lost, " timestamps and samples."),
                  certainty(best, false, true));
  }
  const auto base = std::ranges::find_if(all, [&](const Candidate& c) {
    const ExecutorLabel label(c.name());
    return label.name == kBaselineExecutor && label.stack == ExecutorLabel(best.name()).stack;
  });
  const bool to_default = base != all.begin() && base != all.end();
  const Candidate& rival = to_default ? *base : all[1];
  if (shown_number(best.p99()) == shown_number(rival.p99()))  // people see one value
    return concat(chain, ": the data is as old under ", best.name(), " as under ", rival.name(), ": at most ",
                  shown_number(best.p99()), " ms in 99 of 100 outputs.", certainty(best, to_default));
  if (!to_default)
    return concat(youngest, "; next ", all[1].name(), " (", shown_number(all[1].p99()), ").",
                  certainty(best, false));
  return concat(youngest, program::text(", %.0f %% less than under ", 100 * (1 - best.p99() / base->p99())),
                base->name(), " (", shown_number(base->p99()), ").", price(best, *base),
                certainty(best, true));
}

}  // namespace

std::vector<std::string> starved(const ExecutorSummary& executor) {
  std::vector<std::string> all;
  for (const TaskSummary& t : executor.tasks) {
    const std::string ran = concat(" ran ", t.account[Outcome::ran], " of ", t.account.accounted(), " times");
    if (t.starved()) all.push_back(t.task + (t.never_ran() ? " never ran" : ran));
  }
  return all;
}

std::vector<std::string> verdict(const Summary& summary) {
  std::vector<std::string> sentences;
  const std::size_t chains = summary.executors.empty() ? 0 : summary.executors.front().chains.size();
  for (std::size_t chain = 0; chain < chains; ++chain) {
    const std::vector<Candidate> all = candidates(summary, chain);
    std::vector<std::string> left_out;
    for (const ExecutorSummary& e : summary.executors)
      if (e.overload.empty() && std::ranges::count(all, &e, &Candidate::executor) == 0)
        left_out.push_back(e.executor);
    if (all.empty()) continue;
    sentences.push_back(sentence(summary.executors.front().chains[chain].chain, all));
    if (!left_out.empty())
      sentences.back() +=
          concat(" Left out, as outputs are missing or tasks starve: ", program::joined(left_out), ".");
  }
  std::vector<std::string> overloaded;
  for (const ExecutorSummary& e : summary.executors)
    if (!e.overload.empty()) overloaded.push_back(e.executor);
  if (!overloaded.empty() && chains > 0)
    sentences.insert(sentences.begin(), concat("The load is too high for ", program::joined(overloaded),
                                               ": delays grow without end."));
  if (chains == 0 && !summary.executors.empty())
    sentences.emplace_back("The graph has no chain, so no age: add `chains: [{name: ..., nodes: [...]}]`.");
  return sentences;
}

nlohmann::json tables(const Summary& summary) {
  nlohmann::json all = nlohmann::json::array();
  const auto add = [&](const program::Table& table) {
    if (table.rows.empty()) return;
    all.push_back(columns_and_rows(table));
    all.back()["title"] = table.title;
  };
  const std::size_t chains = summary.executors.empty() ? 0 : summary.executors.front().chains.size();
  for (std::size_t chain = 0; chain < chains; ++chain) add(outputs_table(summary, chain, true));
  add(jobs_table(summary));
  add(losses_table(summary));
  add(periods_table(summary, true));
  add(disturbed_table(summary));
  return all;
}

void write_table(std::ostream& out, const Summary& summary, Detail detail) {
  for (const std::string& sentence : verdict(summary)) out << program::wrapped(sentence) << "\n";
  const std::size_t chains = summary.executors.empty() ? 0 : summary.executors.front().chains.size();
  for (std::size_t chain = 0; chain < chains; ++chain) {
    out << chain_table(summary, chain) << '\n';
    if (detail == Detail::all) out << outputs_table(summary, chain, false) << '\n';
  }
  if (!summary.executors.empty() && (chains == 0 || detail == Detail::all))
    out << jobs_table(summary) << '\n';
  if (chains == 0 || detail == Detail::all) {
    const program::Table periods = periods_table(summary, false);
    if (!periods.rows.empty()) out << periods << '\n';
  }
  if (chains > 0)
    out << "Age: from the timestamp of the oldest source to the finish of the output. Hot path: " << kHotPath
        << ". Lost: unused timestamps and samples.\n";
  if (any_beyond_noise(summary))
    out << "* beyond noise: the confidence interval of the ratio to default (summary.json) excludes 1.\n";
  for (const ExecutorSummary& e : summary.executors) {
    if (!e.overload.empty()) out << e.executor << ": " << e.overload << "\n";
    write_starved(out, e);
  }
  for (const ExecutorSummary& e : summary.executors) write_disturbed(out, e);
  for (const ExecutorSummary& e : summary.executors) write_notes(out, e);
}

}  // namespace hotpath::results
