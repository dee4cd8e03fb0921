// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <algorithm>
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

/// Compares a latency with that of the baseline, which may be the same.
void compare(LatencySummary& latency, const RepeatedSamples& own, const RepeatedSamples& baseline,
             const BootstrapOptions& options) {
  if (own.pooled().empty() || baseline.pooled().empty()) return;
  const bool same = &own == &baseline;
  for (const auto& [judged, word] : enum_texts(Judged{}))
    latency.to_default[judged] =
        same ? Estimate{1.0, std::nullopt}
             : ratio_of_quantiles(own, baseline, traits_of(judged).probability, options);
  latency.median_minus_default =
      same ? Estimate{0.0, std::nullopt} : difference_of_quantiles(own, baseline, 0.5, options);
}

/// The hot-path latencies of a chain in all repetitions, and the ages.
using ChainSamples = std::pair<RepeatedSamples, RepeatedSamples>;

double greatest(const std::vector<double>& samples) {
  return samples.empty() ? kNoValue : std::ranges::max(samples);
}

/// Adds a chain of an executor; `repetitions`: in the order of ExecutorSummary::each.
ChainSamples add_chain(ExecutorSummary& executor, const std::string& name,
                       const std::vector<const Repetition*>& repetitions, const BootstrapOptions& options) {
  const std::size_t chain = executor.chains.size();
  ChainSummary& summary = executor.chains.emplace_back();
  summary.chain = name;
  std::vector<std::vector<double>> hot_path, age;  // by repetition
  for (std::size_t i = 0; i < repetitions.size(); ++i) {
    const std::vector<ChainRecord>& records = repetitions[i]->trace.chains;
    std::vector<const ChainRecord*> outputs;
    for (const ChainRecord& r : records)
      if (r.chain == chain) outputs.push_back(&r);
    summary.add(outputs);
    hot_path.push_back(latencies_ms(records, chain, Latency::hot_path));
    age.push_back(latencies_ms(records, chain, Latency::age));
    executor.each[i].chains.push_back({outputs.size(), greatest(hot_path.back()), greatest(age.back())});
  }
  ChainSamples samples{RepeatedSamples(std::move(hot_path)), RepeatedSamples(std::move(age))};
  summary.hot_path = latency_summary(samples.first, options);
  summary.end_to_end = latency_summary(samples.second, options);
  summary.settle();
  return samples;
}

/// Adds a repetition without its chains.
void add_repetition(ExecutorSummary& executor, const TaskSet& set, const Repetition& r, Duration warm_up) {
  const Trace& trace = r.trace;
  executor.usage += r.usage;
  executor.lost_records += trace.lost_records;
  if (std::vector<std::string> marks = disturbances(r.usage); !marks.empty())
    executor.disturbed.push_back({trace.repetition, std::move(marks)});
  RepetitionMeasures& each = executor.each.emplace_back();
  each.repetition = trace.repetition;
  std::vector<TaskMeasures> measures = r.measures;
  if (measures.empty()) {
    JobMeasures of_jobs(set, trace.epoch + warm_up, trace.end);
    for (const JobRecord& job : trace.jobs) of_jobs.add(job);
    measures = of_jobs.result();
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    TaskAccount& a = measures[id].account;
    if (!r.expected.empty()) a.expected = r.expected[id];
    each.add(a);
    each.never_ran += never_ran(a);
    if (!a.balanced())
      executor.unbalanced.push_back({trace.repetition, set[id].name, a.accounted(), a.expected});
    each.deadline_overruns += measures[id].after_warm_up.deadline_overruns;
    executor.tasks[id].add(std::move(measures[id]));
  }
}

/// Adds the executor to the summary, without comparisons, and returns the samples of its chains.
std::vector<ChainSamples> add_executor(Summary& summary, const TaskSet& set, const ExecutorRuns& runs,
                                       const SummaryOptions& options) {
  ExecutorSummary& executor = summary.executors.emplace_back();
  executor.executor = runs.executor;
  executor.repetitions = runs.repetitions.size();
  const bool no_subscriptions = timers_only(set);
  for (const Task& task : set.tasks) {
    TaskSummary& t = executor.tasks.emplace_back();
    t.task = task.name;
    t.kind = task.kind;
    t.timers_only = no_subscriptions;
    t.period = task.period;
    t.deadline = task.deadline;
  }
  // Stored repetitions of a live run are in the order in which they ran.
  std::vector<const Repetition*> repetitions;
  for (const Repetition& r : runs.repetitions) repetitions.push_back(&r);
  std::ranges::stable_sort(repetitions, {}, [](const Repetition* r) { return r->trace.repetition; });
  Duration length{};
  for (const Repetition* const r : repetitions) {
    length += r->trace.end - r->trace.epoch;
    add_repetition(executor, set, *r, options.warm_up);
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    TaskSummary& task = executor.tasks[id];
    const double jobs = static_cast<double>(task.account[Outcome::ran]);
    task.busy_share = jobs * to_ms(set[id].wcet) / std::max(to_ms(length), 1e-9);
    for (Distribution* const of : task.distributions()) of->settle();
  }
  std::vector<ChainSamples> samples;
  for (const std::string& chain : options.chains)
    samples.push_back(add_chain(executor, chain, repetitions, options.bootstrap));
  executor.settle();
  return samples;
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
  const bool counted = counts(r, counted_from_);
  measures.add(task, r, counted, counted_from_, end_);
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

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  std::vector<std::vector<ChainSamples>> samples(runs.size());  // by executor
  for (std::size_t e = 0; e < runs.size(); ++e) samples[e] = add_executor(summary, set, runs[e], options);
  for (std::size_t e = 0; e < samples.size(); ++e) {
    // `default` on the same stack, such as `default@rclcpp` for `rm-ro@rclcpp`.
    ExecutorLabel baseline(kBaselineExecutor);
    baseline.stack = ExecutorLabel(summary.executors[e].executor).stack;
    const auto found = std::ranges::find(summary.executors, baseline.text(), &ExecutorSummary::executor);
    if (found == summary.executors.end()) continue;
    const auto& others = samples[static_cast<std::size_t>(found - summary.executors.begin())];
    for (std::size_t c = 0; c < others.size(); ++c) {
      ChainSummary& chain = summary.executors[e].chains[c];
      compare(chain.hot_path, samples[e][c].first, others[c].first, options.bootstrap);
      compare(chain.end_to_end, samples[e][c].second, others[c].second, options.bootstrap);
    }
  }
  return summary;
}

}  // namespace hotpath::results
