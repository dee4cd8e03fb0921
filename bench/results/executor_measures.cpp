// SPDX-License-Identifier: Apache-2.0
#include "results/executor_measures.hpp"

#include "results/executor_label.hpp"

#include <algorithm>
#include <functional>

#include "hotpath/core/registry.hpp"

namespace hotpath::results {
namespace {

LatencySummary latency_summary(const RepeatedSamples& samples, const BootstrapOptions& options) {
  LatencySummary summary{.quantiles = quantiles(samples.pooled()), .low = {}, .high = {}};
  for (const auto& [key, probability, of, has_interval] : kQuantiles) {
    if (!has_interval) continue;
    const Estimate estimate = estimate_quantiles(samples, {&probability, 1}, options).front();
    if (estimate.interval)
      summary.low.*of = estimate.interval->low, summary.high.*of = estimate.interval->high;
  }
  return summary;
}

/// The baseline of an executor: `default` on the same stack, such as `default@rclcpp` for
/// `rm-ro@rclcpp`.
std::string baseline_of(const std::string& executor) {
  ExecutorLabel baseline(kBaselineExecutor);
  baseline.stack = ExecutorLabel(executor).stack;
  return baseline.text();
}

/// The quantiles of the samples, which are freed.
Quantiles quantiles_of(std::deque<double>& samples) {
  const std::deque<double> taken = std::exchange(samples, {});
  return quantiles({taken.begin(), taken.end()});
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

ExecutorMeasures::ExecutorMeasures(std::string executor, const TaskSet& set, const SummaryOptions& options)
    : set_(set),
      options_(options),
      timers_only_(timers_only(set)),
      responses_(set.size()),
      authors_(timers_only_ ? set.size() : 0),
      periods_(set.size()),
      latencies_(options.chains.size()) {
  summary_.executor = std::move(executor);
  summary_.chains.resize(options.chains.size());
  for (const Task& task : set.tasks) {
    TaskSummary& t = summary_.tasks.emplace_back();
    t.task = task.name;
    t.kind = task.kind;
    t.period = task.period;
    t.deadline = task.deadline;
  }
}

void ExecutorMeasures::begin(Time epoch, Time end) {
  const Time counted_from = epoch + options_.warm_up;
  length_ += end - epoch;
  current_.emplace(Current{counted_from, end, {}, std::nullopt});
  current_->of_timers.resize(set_.size());
  if (timers_only_) current_->next_calls.emplace(set_);
}

void ExecutorMeasures::add(const JobRecord& r) {
  const TaskId id = r.job.task;
  const Time counted_from = current_->counted_from;
  TaskSummary& task = summary_.tasks[id];
  task.add(set_[id], r, counted_from, current_->end);
  if (current_->next_calls) current_->next_calls->add(r);
  if (!counts(r, counted_from)) return;
  responses_[id].push_back(to_ms(r.response_time()));
  if (task.kind == TaskKind::timer) current_->of_timers[id].push_back({r.job.sequence, r.start, r.finish});
}

void ExecutorMeasures::end_timer(TaskId timer, std::vector<CountedJob> jobs) {
  if (current_->next_calls) {
    for (const CountedJob& job : jobs) {
      const Time next_call = current_->next_calls->at(timer, job.start);
      authors_[timer].push_back(to_ms(response_authors(set_[timer], next_call, job.finish)));
    }
  }
  std::ranges::sort(jobs, {}, &CountedJob::sequence);
  for (std::size_t k = 1; k < jobs.size(); ++k) periods_[timer].push_back(jobs[k].start - jobs[k - 1].start);
}

void ExecutorMeasures::end(std::uint32_t place, std::uint32_t repetition, const ProcessUsage& usage,
                           std::uint64_t lost_records, const std::vector<TaskAccount>& accounts) {
  if (current_->next_calls) current_->next_calls->sort();
  for (TaskId id = 0; id < set_.size(); ++id) end_timer(id, std::move(current_->of_timers[id]));
  current_.reset();
  Ended& ended = ended_[place] = {usage, lost_records, {repetition}, {}};
  std::uint64_t overruns = 0;
  for (const TaskSummary& task : summary_.tasks) overruns += task.after_warm_up.deadline_overruns;
  ended.measures.deadline_overruns = overruns - std::exchange(overruns_before_, overruns);
  for (const TaskAccount& a : accounts) {
    auto& sum = summary_.tasks[a.task].account.count;
    std::ranges::transform(sum, a.count, sum.begin(), std::plus());
    ended.measures.skipped += a[Outcome::skipped];
    ended.measures.overwritten += a[Outcome::overwritten];
    ended.measures.never_ran += results::never_ran(a);
    if (a.balanced()) continue;
    ended.unbalanced.push_back({repetition, set_[a.task].name, a.accounted(), a.expected});
  }
}

void ExecutorMeasures::add(std::uint32_t place, const ChainRecord& r) {
  Latencies& latencies = latencies_[r.chain][place];
  latencies.hot_path.push_back(to_ms(r.hot_path_latency));
  if (r.end_to_end_latency.count() >= 0) latencies.end_to_end.push_back(to_ms(r.end_to_end_latency));
  if (r.disparity.count() >= 0) latencies.disparity.push_back(to_ms(r.disparity));
  if (r.finish != kNever) latencies.finishes.push_back(r.finish);
  summary_.chains[r.chain].drops += r.dropped;
}

ChainSummary ExecutorMeasures::finish_chain(std::size_t chain, std::vector<ChainSamples>& all) {
  std::vector<std::vector<double>> hot, end_to_end;  // by repetition
  std::vector<double> intervals, disparities;
  for (auto& [place, latencies] : latencies_[chain]) {
    hot.push_back(std::move(latencies.hot_path));
    end_to_end.push_back(std::move(latencies.end_to_end));
    std::ranges::copy(latencies.disparity, std::back_inserter(disparities));
    std::vector<Time>& finishes = latencies.finishes;
    std::ranges::sort(finishes);
    for (std::size_t k = 1; k < finishes.size(); ++k)
      intervals.push_back(to_ms(finishes[k] - finishes[k - 1]));
  }
  ChainSummary summary = std::move(summary_.chains[chain]);
  summary.chain = options_.chains[chain];
  all.push_back({RepeatedSamples(std::move(hot)), RepeatedSamples(std::move(end_to_end))});
  const ChainSamples& samples = all.back();
  summary.hot_path = latency_summary(samples.hot_path, options_.bootstrap);
  summary.end_to_end = latency_summary(samples.end_to_end, options_.bootstrap);
  summary.interval_ms = quantiles(std::move(intervals));
  summary.disparity_ms = quantiles(std::move(disparities));
  return summary;
}

ExecutorSummary ExecutorMeasures::finish(std::vector<ChainSamples>& all) && {
  summary_.repetitions = ended_.size();
  for (TaskId id = 0; id < set_.size(); ++id) {
    TaskSummary& task = summary_.tasks[id];
    const double jobs = static_cast<double>(task.account[Outcome::ran]);
    task.busy_share = jobs * to_ms(set_[id].wcet) / std::max(to_ms(length_), 1e-9);
    task.response_ms = quantiles_of(responses_[id]);
    if (timers_only_) task.response_authors_ms = quantiles_of(authors_[id]);
    if (task.kind == TaskKind::timer) {
      std::vector<double> periods, deviations;
      for (const Duration period : std::exchange(periods_[id], {})) {
        periods.push_back(to_ms(period));
        deviations.push_back(to_ms(period_deviation(set_[id], period)));
      }
      task.period_ms = quantiles(std::move(periods));
      task.period_deviation_ms = quantiles(std::move(deviations));
    }
    summary_.executed += task.account[Outcome::ran];
    summary_.skipped += task.account[Outcome::skipped];
    summary_.overwritten += task.account[Outcome::overwritten];
    summary_.after_warm_up += task.after_warm_up;
  }
  for (auto& [place, ended] : ended_) {
    if (std::vector<std::string> marks = disturbances(ended.usage); !marks.empty())
      summary_.disturbed.push_back({ended.measures.repetition, std::move(marks)});
    summary_.usage += ended.usage;
    summary_.lost_records += ended.lost_records;
    for (const auto& of_chain : latencies_) {
      const auto of = of_chain.find(place);
      RepetitionMeasures::OfChain& chain = ended.measures.chains.emplace_back();
      if (of == of_chain.end()) continue;
      chain.outputs = of->second.hot_path.size();
      chain.worst_hot_path_ms = std::ranges::max(of->second.hot_path);
      const std::vector<double>& ages = of->second.end_to_end;
      if (!ages.empty()) chain.worst_age_ms = std::ranges::max(ages);
    }
    summary_.each.push_back(std::move(ended.measures));
    std::ranges::move(ended.unbalanced, std::back_inserter(summary_.unbalanced));
  }
  if (summary_.executed > 0 && summary_.usage.wall > Duration{}) {  // a simulation uses no CPU time
    summary_.cpu_per_callback_us =
        static_cast<double>(summary_.usage.cpu_time.count()) / 1e3 / static_cast<double>(summary_.executed);
  }
  for (std::size_t c = 0; c < options_.chains.size(); ++c) summary_.chains[c] = finish_chain(c, all);
  return std::move(summary_);
}

void compare_with_baseline(Summary& summary, const std::vector<std::vector<ChainSamples>>& samples) {
  for (std::size_t e = 0; e < summary.executors.size(); ++e) {
    const std::string name = baseline_of(summary.executors[e].executor);
    const auto base = std::ranges::find(summary.executors, name, &ExecutorSummary::executor);
    if (base == summary.executors.end()) continue;
    const auto baseline = static_cast<std::size_t>(base - summary.executors.begin());
    for (std::size_t c = 0; c < samples[e].size(); ++c) {
      const ChainSamples &own = samples[e][c], &of_baseline = samples[baseline][c];
      ChainSummary& chain = summary.executors[e].chains[c];
      compare(chain.hot_path, own.hot_path, of_baseline.hot_path, summary.bootstrap);
      compare(chain.end_to_end, own.end_to_end, of_baseline.end_to_end, summary.bootstrap);
    }
  }
}

}  // namespace hotpath::results
