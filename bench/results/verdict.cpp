// SPDX-License-Identifier: Apache-2.0
#include "results/summary_table.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/registry.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::results {
namespace {

using program::concat;

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

/// The timer whose starts are furthest from their period.
const TaskSummary* least_regular(const ExecutorSummary& executor) {
  const TaskSummary* worst = nullptr;
  for (const TaskSummary& task : executor.tasks) {
    if (task.period_deviation_ms.n == 0) continue;
    if (worst == nullptr || task.period_deviation_ms.p99 > worst->period_deviation_ms.p99) worst = &task;
  }
  return worst;
}

/// What the winner costs compared with the baseline.
std::string price(const Candidate& winner, const Candidate& baseline) {
  std::vector<std::string> prices;
  const ExecutorSummary &own = *winner.executor, &other = *baseline.executor;
  if (own.lost() > other.lost())
    prices.push_back(concat("it loses ", own.lost(), " timestamps and samples instead of ", other.lost()));
  const TaskSummary* timer = least_regular(own);
  if (timer != nullptr) {
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
  const std::optional<Estimate>& ratio = winner.age->p99_to_default;
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

/// Whether people see one value.
bool same(const Candidate& a, const Candidate& b) { return shown_number(a.p99()) == shown_number(b.p99()); }

/// What the only executor with results loses.
std::string losses(const ExecutorSummary& executor) {
  return executor.lost() == 0 ? "" : concat(" It loses ", executor.lost(), " timestamps and samples.");
}

std::string sentence(const std::string& chain, const std::vector<Candidate>& all) {
  const Candidate& best = all.front();
  const std::string youngest = concat(chain, ": the data is youngest under ", best.name(), ": at most ",
                                      shown_number(best.p99()), " ms old in 99 of 100 outputs");
  if (all.size() == 1)
    return concat(chain, ": under ", best.name(), ", half of the outputs use data that is at most ",
                  shown_number(best.age->quantiles.p50), " ms old, 99 of 100 at most ",
                  shown_number(best.p99()), ".", losses(*best.executor), certainty(best, false, true));
  const auto base = std::ranges::find_if(all, [&](const Candidate& c) {
    const ExecutorLabel label(c.name());
    return label.name == kBaselineExecutor && label.stack == ExecutorLabel(best.name()).stack;
  });
  const bool to_default = base != all.begin() && base != all.end();
  const Candidate& rival = to_default ? *base : all[1];
  if (same(best, rival))
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

std::string shown_number(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  const int decimals = size < 0.9995 ? 3 : size < 9.995 ? 2 : size < 999.5 ? 1 : 0;
  return program::fixed(value, decimals);
}

std::string shown_difference(double ratio) {
  const double percent = std::round(100 * (ratio - 1));
  return percent == 0 ? "0 %" : program::text("%+.0f %%", percent);
}

bool beyond_noise(const std::optional<Estimate>& ratio) {
  return ratio && ratio->interval && (ratio->interval->high < 1 || ratio->interval->low > 1);
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

}  // namespace hotpath::results
