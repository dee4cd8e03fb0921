// SPDX-License-Identifier: Apache-2.0
#include "results/executor_measures.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "hotpath/core/registry.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::results {
namespace {

LatencySummary latency_summary(const RepeatedSamples& samples, const BootstrapOptions& options) {
  LatencySummary summary{.quantiles = quantiles(samples.pooled()), .low = {}, .high = {}};
  for (const QuantileTraits& of : kQuantiles) {
    if (!of.has_interval) continue;
    const Estimate estimate = estimate_quantiles(samples, {&of.probability, 1}, options).front();
    if (!estimate.interval) continue;
    summary.low.*of.of = estimate.interval->low;
    summary.high.*of.of = estimate.interval->high;
  }
  return summary;
}

double greatest(const std::vector<double>& samples) {
  return samples.empty() ? kNoValue : std::ranges::max(samples);
}

/// Compares a latency with that of the baseline, which may be the same.
void compare(LatencySummary& latency, const RepeatedSamples& own, const RepeatedSamples& baseline,
             const BootstrapOptions& options) {
  if (own.pooled().empty() || baseline.pooled().empty()) return;
  const bool same = &own == &baseline;
  const auto ratio = [&](double probability) {
    return same ? Estimate{1.0, std::nullopt} : ratio_of_quantiles(own, baseline, probability, options);
  };
  latency.median_to_default = ratio(0.5);
  latency.p99_to_default = ratio(0.99);
  latency.max_to_default = ratio(1.0);
  latency.median_minus_default =
      same ? Estimate{0.0, std::nullopt} : difference_of_quantiles(own, baseline, 0.5, options);
}

}  // namespace

std::vector<std::string> disturbances(const ProcessUsage& usage) {
  struct Limit {
    Duration ProcessUsage::*time;
    double percent;  ///< Of the length of the repetition.
    const char* words;
  };
  constexpr Limit kLimits[] = {{&ProcessUsage::stolen, 0.5, "stolen by the hypervisor"},
                               {&ProcessUsage::throttled, 0.5, "throttled by a quota or by heat"},
                               {&ProcessUsage::others, 5, "used by other processes"}};
  // Three ticks of the kernel's clock: less says nothing.
  constexpr Duration kLeast = std::chrono::milliseconds(30);
  std::vector<std::string> marks;
  for (const auto& [time, most, words] : kLimits) {
    if (usage.wall <= Duration::zero() || usage.*time < kLeast) continue;
    const double percent = usage.percent(usage.*time);
    if (percent > most) marks.push_back(program::text("%.1f %% of the time %s", percent, words));
  }
  return marks;
}

JobMeasures::JobMeasures(const TaskSet& set, Time counted_from, Time end, bool keeps_samples)
    : set_(set),
      counted_from_(counted_from),
      end_(end),
      tasks_(set.size()),
      starts_(set.size()),
      counted_(set.size()) {
  if (keeps_samples && timers_only(set)) next_calls_.emplace(set);
  if (keeps_samples) return;
  for (TaskMeasures& task : tasks_)
    for (Distribution* const of : task.distributions()) of->samples.reset();
}

void JobMeasures::add(const JobRecord& r) {
  const Task& task = set_[r.job.task];
  TaskMeasures& measures = tasks_[r.job.task];
  measures.add(task, r, counted_from_, end_);
  const bool counted = counts(r, counted_from_);
  if (task.kind == TaskKind::timer && r.outcome == Outcome::ran)
    starts_[r.job.task].add(r, counted, [&](Duration period) { measures.add_period(task, period); });
  if (!next_calls_) return;
  next_calls_->add(r);
  if (counted) counted_[r.job.task].emplace_back(r.start, r.finish);
}

std::vector<TaskMeasures> JobMeasures::result() {
  if (next_calls_) next_calls_->sort();
  for (TaskId id = 0; id < set_.size(); ++id) {
    starts_[id].end([&](Duration period) { tasks_[id].add_period(set_[id], period); });
    for (const auto& [start, finish] : counted_[id])
      tasks_[id].response_authors_ms.add(response_authors(set_[id], next_calls_->at(id, start), finish));
  }
  return std::move(tasks_);
}

ExecutorMeasures::ExecutorMeasures(std::string executor, const TaskSet& set, const SummaryOptions& options)
    : set_(set), options_(options), latencies_(options.chains.size()) {
  summary_.executor = std::move(executor);
  for (const std::string& chain : options.chains) summary_.chains.emplace_back().chain = chain;
  for (const Task& task : set.tasks) {
    TaskSummary& t = summary_.tasks.emplace_back();
    t.task = task.name;
    t.kind = task.kind;
    t.timers_only = timers_only(set);
    t.period = task.period;
    t.deadline = task.deadline;
  }
}

void ExecutorMeasures::begin(Time epoch, Time end) {
  length_ += end - epoch;
  current_.emplace(set_, epoch + options_.warm_up, end);
}

void ExecutorMeasures::end(std::uint32_t repetition, const ProcessUsage& usage, std::uint64_t lost_records,
                           const std::vector<TaskAccount>& accounts, std::vector<TaskMeasures> measures) {
  std::vector<TaskMeasures> added = current_->result();
  if (measures.empty()) measures = std::move(added);
  current_.reset();
  summary_.usage += usage;
  summary_.lost_records += lost_records;
  if (std::vector<std::string> marks = disturbances(usage); !marks.empty())
    summary_.disturbed.push_back({repetition, std::move(marks)});
  RepetitionMeasures& each = summary_.each.emplace_back();
  each.repetition = repetition;
  each.chains.resize(options_.chains.size());
  for (TaskId id = 0; id < set_.size(); ++id) {
    each.deadline_overruns += measures[id].after_warm_up.deadline_overruns;
    summary_.tasks[id].add(std::move(measures[id]));
  }
  for (const TaskAccount& a : accounts) {
    auto& sum = summary_.tasks[a.task].account.count;
    std::ranges::transform(sum, a.count, sum.begin(), std::plus());
    each.skipped += a[Outcome::skipped];
    each.overwritten += a[Outcome::overwritten];
    each.never_ran += never_ran(a);
    if (!a.balanced())
      summary_.unbalanced.push_back({repetition, set_[a.task].name, a.accounted(), a.expected});
  }
}

void ExecutorMeasures::add(std::uint32_t repetition, const ChainRecord& r) {
  Latencies& latencies = latencies_[r.chain][repetition];
  latencies.hot_path.push_back(to_ms(r.hot_path_latency));
  if (r.end_to_end_latency.count() >= 0) latencies.end_to_end.push_back(to_ms(r.end_to_end_latency));
  if (r.finish != kNever) latencies.finishes.push_back(r.finish);
  summary_.chains[r.chain].add(r);
}

void ExecutorMeasures::finish_chain(std::size_t chain) {
  std::vector<std::vector<double>> hot_path, end_to_end;  // by repetition
  ChainSummary& summary = summary_.chains[chain];
  for (auto& [repetition, of] : latencies_[chain]) {
    std::ranges::find(summary_.each, repetition, &RepetitionMeasures::repetition)->chains[chain] = {
        of.hot_path.size(), greatest(of.hot_path), greatest(of.end_to_end)};
    hot_path.push_back(std::move(of.hot_path));
    end_to_end.push_back(std::move(of.end_to_end));
    std::ranges::sort(of.finishes);
    for (std::size_t k = 1; k < of.finishes.size(); ++k)
      summary.interval_ms.add(of.finishes[k] - of.finishes[k - 1]);
  }
  const ChainSamples& samples = samples_.emplace_back(
      ChainSamples{RepeatedSamples(std::move(hot_path)), RepeatedSamples(std::move(end_to_end))});
  summary.hot_path = latency_summary(samples.hot_path, options_.bootstrap);
  summary.end_to_end = latency_summary(samples.end_to_end, options_.bootstrap);
  summary.interval_ms.settle();
  summary.disparity_ms.settle();
}

void ExecutorMeasures::finish_task(TaskId id) {
  TaskSummary& task = summary_.tasks[id];
  const double jobs = static_cast<double>(task.account[Outcome::ran]);
  task.busy_share = jobs * to_ms(set_[id].wcet) / std::max(to_ms(length_), 1e-9);
  for (Distribution* const of : task.distributions()) of->settle();
  summary_.executed += task.account[Outcome::ran];
  summary_.skipped += task.account[Outcome::skipped];
  summary_.overwritten += task.account[Outcome::overwritten];
  summary_.after_warm_up += task.after_warm_up;
}

void ExecutorMeasures::finish() {
  // Stored repetitions of a live run are in the order in which they ran.
  std::ranges::stable_sort(summary_.each, {}, &RepetitionMeasures::repetition);
  std::ranges::stable_sort(summary_.disturbed, {}, &DisturbedRepetition::repetition);
  std::ranges::stable_sort(summary_.unbalanced, {}, &Imbalance::repetition);
  summary_.repetitions = summary_.each.size();
  for (TaskId id = 0; id < set_.size(); ++id) finish_task(id);
  for (std::size_t c = 0; c < options_.chains.size(); ++c) finish_chain(c);
  if (summary_.executed > 0 && summary_.usage.wall > Duration{}) {  // a simulation uses no CPU time
    summary_.cpu_per_callback_us =
        static_cast<double>(summary_.usage.cpu_time.count()) / 1e3 / static_cast<double>(summary_.executed);
  }
}

Summary ExecutorMeasures::summary(std::vector<ExecutorMeasures> all, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  for (ExecutorMeasures& m : all) {
    m.finish();
    summary.executors.push_back(std::move(m.summary_));
  }
  for (std::size_t e = 0; e < all.size(); ++e) {
    // `default` on the same stack, such as `default@rclcpp` for `rm-ro@rclcpp`.
    ExecutorLabel baseline(kBaselineExecutor);
    baseline.stack = ExecutorLabel(summary.executors[e].executor).stack;
    const auto found = std::ranges::find(summary.executors, baseline.text(), &ExecutorSummary::executor);
    if (found == summary.executors.end()) continue;
    const std::vector<ChainSamples>& samples =
        all[static_cast<std::size_t>(found - summary.executors.begin())].samples_;
    for (std::size_t c = 0; c < samples.size(); ++c) {
      ChainSummary& chain = summary.executors[e].chains[c];
      compare(chain.hot_path, all[e].samples_[c].hot_path, samples[c].hot_path, options.bootstrap);
      compare(chain.end_to_end, all[e].samples_[c].end_to_end, samples[c].end_to_end, options.bootstrap);
    }
  }
  return summary;
}

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  std::vector<ExecutorMeasures> all;
  all.reserve(runs.size());
  for (const ExecutorRuns& of_executor : runs) {
    ExecutorMeasures& measures = all.emplace_back(of_executor.executor, set, options);
    for (const auto& [trace, usage, accounts, of_jobs] : of_executor.repetitions) {
      measures.begin(trace.epoch, trace.end);
      for (const JobRecord& r : trace.jobs) measures.add(r);
      measures.end(trace.repetition, usage, trace.lost_records, accounts, of_jobs);
      for (const ChainRecord& r : trace.chains) measures.add(trace.repetition, r);
    }
  }
  return ExecutorMeasures::summary(std::move(all), options);
}

}  // namespace hotpath::results
