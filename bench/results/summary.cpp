// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <span>
#include <utility>

#include "hotpath/core/registry.hpp"
#include "results/schedule.hpp"

namespace hotpath {
namespace {

constexpr std::array kInterval = {0.5, 0.99, 0.999, 1.0};

LatencySummary latency_summary(const RepeatedSamples& samples, const BootstrapOptions& options) {
  const auto estimates = estimate_quantiles(samples, kInterval, options);
  return {quantiles(samples.pooled()), estimates[0].interval, estimates[1].interval, estimates[2].interval,
          estimates[3].interval};
}

/// Without comparisons; `hot_path` gets its samples, in milliseconds.
ChainSummary summarize_chain(const ExecutorRuns& runs, std::uint32_t chain, const SummaryOptions& options,
                             RepeatedSamples& hot_path) {
  ChainSummary summary;
  summary.chain = options.chains[chain];
  std::vector<std::vector<double>> hot, end_to_end;  // by repetition
  for (const Repetition& repetition : runs.repetitions) {
    hot.emplace_back();
    end_to_end.emplace_back();
    for (const ChainRecord& r : repetition.trace.chains) {
      if (r.chain != chain) continue;
      hot.back().push_back(to_ms(r.hot_path_latency));
      if (r.end_to_end_latency.count() >= 0) end_to_end.back().push_back(to_ms(r.end_to_end_latency));
      summary.drops += r.dropped;
    }
  }
  hot_path = RepeatedSamples(std::move(hot));
  summary.hot_path = latency_summary(hot_path, options.bootstrap);
  summary.end_to_end = latency_summary(RepeatedSamples(std::move(end_to_end)), options.bootstrap);
  return summary;
}

void append_periods(std::vector<std::pair<std::uint64_t, Time>> starts, std::vector<double>& periods_ms) {
  std::ranges::sort(starts);
  for (std::size_t k = 1; k < starts.size(); ++k) {
    periods_ms.push_back(to_ms(starts[k].second - starts[k - 1].second));
  }
}

/// The tasks of one executor, repetition by repetition.
class TaskSummaries {
 public:
  TaskSummaries(const TaskSet& set, const SummaryOptions& options)
      : set_(set), options_(options), tasks_(set.size()), responses_(set.size()), authors_(set.size()) {
    for (TaskId id = 0; id < set.size(); ++id) {
      tasks_[id].task = set[id].name;
      tasks_[id].kind = set[id].kind;
      tasks_[id].period = set[id].period;
      tasks_[id].deadline = set[id].deadline;
    }
    for (const TaskId id : options.cyclic_timers) periods_[id];
  }

  void add(const Repetition& repetition) {
    const Time counted_from = repetition.trace.epoch + options_.warm_up;
    std::map<TaskId, std::vector<std::pair<std::uint64_t, Time>>> starts;
    for (const JobRecord& r : repetition.trace.jobs) {
      const TaskId id = r.job.task;
      Duration& longest_wait = tasks_[id].longest_wait;
      longest_wait = std::max(longest_wait, wait_of(r, counted_from, repetition.trace.end));
      if (set_[id].kind == TaskKind::timer) tasks_[id].after_warm_up.add(set_[id], r, counted_from);
      if (!counts(r, counted_from)) continue;
      responses_[id].push_back(to_ms(response_time(r)));
      if (periods_.count(id) != 0) starts[id].emplace_back(r.job.sequence, r.start);
    }
    for (auto& [id, of_task] : starts) append_periods(std::move(of_task), periods_[id]);
    for (const TaskAccount& account : repetition.accounts) {
      auto& sum = tasks_[account.task].account.count;
      std::ranges::transform(sum, account.count, sum.begin(), std::plus());
    }
    if (timers_only(set_)) add_authors_responses(repetition.trace);
  }

  std::vector<TaskSummary> finish() && {
    for (TaskId id = 0; id < set_.size(); ++id) {
      tasks_[id].response_ms = quantiles(std::move(responses_[id]));
      if (timers_only(set_)) tasks_[id].response_authors_ms = quantiles(std::move(authors_[id]));
    }
    for (auto& [id, of_task] : periods_) tasks_[id].period_ms = quantiles(std::move(of_task));
    return std::move(tasks_);
  }

 private:
  void add_authors_responses(const Trace& trace) {
    const Schedule schedule = schedule_of(set_, trace);
    for (const ExecutedJob& job : schedule.jobs) {
      if (!job.finished() || job.timestamp < Time{} + options_.warm_up) continue;
      authors_[job.task].push_back(to_ms(response_authors(schedule, job)));
    }
  }

  const TaskSet& set_;
  const SummaryOptions& options_;
  std::vector<TaskSummary> tasks_;
  std::vector<std::vector<double>> responses_, authors_;  // ms, by task
  std::map<TaskId, std::vector<double>> periods_;         // ms
};

ExecutorSummary without_chains(const TaskSet& set, const ExecutorRuns& runs, const SummaryOptions& options) {
  ExecutorSummary summary;
  summary.executor = runs.executor;
  summary.repetitions = runs.repetitions.size();
  TaskSummaries tasks(set, options);
  for (const Repetition& repetition : runs.repetitions) tasks.add(repetition);
  summary.tasks = std::move(tasks).finish();
  for (const TaskSummary& task : summary.tasks) {
    summary.executed += task.account[Outcome::ran];
    summary.skipped += task.account[Outcome::skipped];
    summary.overwritten += task.account[Outcome::overwritten];
    summary.after_warm_up += task.after_warm_up;
  }
  for (const Repetition& repetition : runs.repetitions) {
    summary.usage += repetition.usage;
    summary.lost_records += repetition.trace.lost_records;
    for (const TaskAccount& a : repetition.accounts) {
      if (a.balanced()) continue;
      summary.unbalanced.push_back(
          {repetition.trace.repetition, set[a.task].name, a.accounted(), a.expected});
    }
  }
  if (summary.executed > 0 && summary.usage.wall > Duration{}) {  // a simulation uses no CPU time
    summary.cpu_per_callback_us =
        static_cast<double>(summary.usage.cpu_time.count()) / 1e3 / static_cast<double>(summary.executed);
  }
  return summary;
}

/// What an executor is compared with: `default`, on a stack of its own (`rm-ro@rclcpp`) that of the stack.
std::string baseline_of(const std::string& executor) {
  const std::size_t stack = std::min(executor.find('@'), executor.size());
  return std::string(kBaselineExecutor) + executor.substr(stack);
}

/// `hot_paths`: samples by executor and chain.
void compare_with_baseline(Summary& summary, const std::vector<std::vector<RepeatedSamples>>& hot_paths) {
  for (std::size_t e = 0; e < summary.executors.size(); ++e) {
    const std::string name = baseline_of(summary.executors[e].executor);
    const auto base = std::ranges::find(summary.executors, name, &ExecutorSummary::executor);
    if (base == summary.executors.end()) continue;
    const auto baseline = static_cast<std::size_t>(base - summary.executors.begin());
    for (std::size_t c = 0; c < hot_paths[e].size(); ++c) {
      const RepeatedSamples& own = hot_paths[e][c];
      const RepeatedSamples& of_baseline = hot_paths[baseline][c];
      ChainSummary& chain = summary.executors[e].chains[c];
      if (e == baseline) {
        chain.median_to_default = chain.max_to_default = Estimate{1.0, std::nullopt};
        chain.median_minus_default = Estimate{0.0, std::nullopt};
        continue;
      }
      chain.median_to_default = ratio_of_quantiles(own, of_baseline, 0.5, summary.bootstrap);
      chain.max_to_default = ratio_of_quantiles(own, of_baseline, 1.0, summary.bootstrap);
      chain.median_minus_default = difference_of_quantiles(own, of_baseline, 0.5, summary.bootstrap);
    }
  }
}

}  // namespace

std::vector<SpeedJudgement> judge_speed(const std::vector<ExecutorRuns>& runs) {
  std::vector<std::span<const SpeedWindow>> all;
  for (const ExecutorRuns& of_executor : runs) {
    for (const Repetition& r : of_executor.repetitions) all.emplace_back(r.speed);
  }
  const std::optional<double> usual = usual_pace(all);
  std::vector<SpeedJudgement> judgements;
  for (const ExecutorRuns& of_executor : runs) {
    SpeedJudgement& judgement = judgements.emplace_back();
    for (const Repetition& r : of_executor.repetitions) {
      if (!usual || !usual_pace({r.speed})) continue;
      ++judgement.observed;
      std::vector<SlowPeriod> slow = slow_periods(r.speed, *usual);
      if (!slow.empty()) judgement.slow.push_back({r.trace.repetition, std::move(slow)});
    }
  }
  return judgements;
}

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  std::vector<std::vector<RepeatedSamples>> hot_paths;  // by executor and chain
  for (const ExecutorRuns& of_executor : runs) {
    ExecutorSummary& executor = summary.executors.emplace_back(without_chains(set, of_executor, options));
    auto& hot_path = hot_paths.emplace_back();
    for (std::uint32_t c = 0; c < options.chains.size(); ++c) {
      executor.chains.push_back(
          summarize_chain(of_executor, c, options, hot_path.emplace_back(RepeatedSamples({}))));
    }
  }
  compare_with_baseline(summary, hot_paths);
  std::vector<SpeedJudgement> speeds = judge_speed(runs);
  for (std::size_t e = 0; e < runs.size(); ++e) summary.executors[e].speed = std::move(speeds[e]);
  return summary;
}

}  // namespace hotpath
