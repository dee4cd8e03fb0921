// SPDX-License-Identifier: Apache-2.0
#include "results/summary.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <unordered_map>
#include <utility>

#include "validation/schedule_comparison.hpp"

namespace hotpath {
namespace {

constexpr std::array kInterval = {0.5, 0.99, 0.999, 1.0};

LatencySummary latency_summary(const RepeatedSamples& samples, const BootstrapOptions& options) {
  const auto estimates = estimate_quantiles(samples, kInterval, options);
  return {quantiles(samples.pooled()), estimates[0].interval, estimates[1].interval, estimates[2].interval,
          estimates[3].interval};
}

/// Both latencies of one chain in milliseconds, a vector for each repetition.
struct ChainSamples {
  std::vector<std::vector<double>> hot_path, end_to_end;
  std::uint64_t drops = 0;
};

std::vector<ChainSamples> chain_samples(const ExecutorRuns& runs, const SummaryOptions& options) {
  std::vector<ChainSamples> samples(options.chains.size());
  for (const Repetition& repetition : runs.repetitions) {
    for (ChainSamples& s : samples) {
      s.hot_path.emplace_back();
      s.end_to_end.emplace_back();
    }
    for (const ChainRecord& r : after_warm_up(repetition.trace, options.chains, options.warm_up)) {
      ChainSamples& s = samples[r.chain];
      s.hot_path.back().push_back(to_ms(r.hot_path_latency));
      if (r.end_to_end_latency.count() >= 0) s.end_to_end.back().push_back(to_ms(r.end_to_end_latency));
      s.drops += r.dropped;
    }
  }
  return samples;
}

void append_periods(std::vector<std::pair<std::uint64_t, Time>> starts, std::vector<double>& periods_ms) {
  std::sort(starts.begin(), starts.end());
  for (std::size_t k = 1; k < starts.size(); ++k) {
    periods_ms.push_back(to_ms(starts[k].second - starts[k - 1].second));
  }
}

bool timers_only(const TaskSet& set) {
  return std::all_of(set.tasks.begin(), set.tasks.end(),
                     [](const Task& task) { return task.kind == TaskKind::timer; });
}

/// By task, after the warm-up.
std::vector<std::vector<double>> authors_responses_ms(const TaskSet& set, const ExecutorRuns& runs,
                                                      Duration warm_up) {
  std::vector<std::vector<double>> responses(set.size());
  for (const Repetition& repetition : runs.repetitions) {
    const Schedule schedule = schedule_of(set, repetition.trace);
    for (const ExecutedJob& job : schedule.jobs) {
      if (!job.finished() || job.timestamp < Time{} + warm_up) continue;
      responses[job.task].push_back(to_ms(response_authors(schedule, job)));
    }
  }
  return responses;
}

std::vector<TaskSummary> task_summaries(const TaskSet& set, const ExecutorRuns& runs,
                                        const SummaryOptions& options) {
  std::vector<TaskSummary> tasks(set.size());
  std::vector<std::vector<double>> responses(set.size());
  std::map<TaskId, std::vector<double>> periods;
  for (const TaskId id : options.cyclic_timers) periods[id];

  for (const Repetition& repetition : runs.repetitions) {
    std::map<TaskId, std::vector<std::pair<std::uint64_t, Time>>> starts;
    const Time counted_from = repetition.trace.epoch + options.warm_up;
    for (const JobRecord& r : repetition.trace.jobs) {
      if (r.outcome != Outcome::ran || r.job.timestamp < counted_from) continue;
      const TaskId id = r.job.task;
      const Duration response = r.finish - r.job.timestamp;
      responses[id].push_back(to_ms(response));
      if (set[id].kind == TaskKind::timer && response > set[id].deadline) ++tasks[id].deadline_overruns;
      if (periods.count(id) != 0) starts[id].emplace_back(r.job.sequence, r.start);
    }
    for (auto& [id, of_task] : starts) append_periods(std::move(of_task), periods[id]);
    for (const TaskAccount& account : repetition.accounts) {
      TaskSummary& task = tasks[account.task];
      task.ran += account[Outcome::ran];
      task.skipped += account[Outcome::skipped];
      task.overwritten += account[Outcome::overwritten];
      task.queued += account[Outcome::queued];
      task.running += account[Outcome::running];
      task.empty += account[Outcome::empty];
    }
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    tasks[id].task = set[id].name;
    tasks[id].kind = set[id].kind;
    tasks[id].response_ms = quantiles(std::move(responses[id]));
  }
  for (auto& [id, of_task] : periods) tasks[id].period_ms = quantiles(std::move(of_task));
  if (timers_only(set)) {
    auto authors = authors_responses_ms(set, runs, options.warm_up);
    for (TaskId id = 0; id < set.size(); ++id) {
      tasks[id].response_authors_ms = quantiles(std::move(authors[id]));
    }
  }
  return tasks;
}

void add_usage(ProcessUsage& total, const ProcessUsage& usage) {
  total.cpu_time += usage.cpu_time;
  total.peak_memory_kib = std::max(total.peak_memory_kib, usage.peak_memory_kib);
  total.voluntary_switches += usage.voluntary_switches;
  total.involuntary_switches += usage.involuntary_switches;
  total.stolen += usage.stolen;
  total.wall += usage.wall;
}

ExecutorSummary without_chains(const TaskSet& set, const ExecutorRuns& runs, const SummaryOptions& options) {
  ExecutorSummary summary;
  summary.executor = runs.executor;
  summary.repetitions = runs.repetitions.size();
  summary.tasks = task_summaries(set, runs, options);
  for (const TaskSummary& task : summary.tasks) {
    summary.executed += task.ran;
    summary.skipped += task.skipped;
    summary.overwritten += task.overwritten;
    summary.deadline_overruns += task.deadline_overruns;
  }
  for (const Repetition& repetition : runs.repetitions) {
    add_usage(summary.usage, repetition.usage);
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

}  // namespace

std::vector<ChainRecord> after_warm_up(const Trace& trace, const std::vector<MeasuredChain>& chains,
                                       Duration warm_up) {
  std::vector<std::unordered_map<std::uint64_t, Time>> sink_timestamps(chains.size());
  for (std::size_t c = 0; c < chains.size(); ++c) {
    const auto& sinks = chains[c].sink_tasks;
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome != Outcome::ran || std::find(sinks.begin(), sinks.end(), r.job.task) == sinks.end()) {
        continue;
      }
      const auto [found, added] = sink_timestamps[c].emplace(r.job.sequence, r.job.timestamp);
      if (!added) found->second = std::min(found->second, r.job.timestamp);
    }
  }
  std::vector<ChainRecord> counted;
  for (const ChainRecord& r : trace.chains) {
    const auto sink = sink_timestamps[r.chain].find(r.sequence);
    const bool early = sink != sink_timestamps[r.chain].end() && sink->second < trace.epoch + warm_up;
    if (!early) counted.push_back(r);
  }
  return counted;
}

Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options) {
  Summary summary{options.warm_up, options.bootstrap, {}};
  const std::size_t chains = options.chains.size();
  std::vector<std::vector<RepeatedSamples>> hot_paths;  // by executor and chain

  for (const ExecutorRuns& of_executor : runs) {
    ExecutorSummary& executor = summary.executors.emplace_back(without_chains(set, of_executor, options));
    auto samples = chain_samples(of_executor, options);
    auto& hot_path = hot_paths.emplace_back();
    for (std::size_t c = 0; c < chains; ++c) {
      ChainSummary& chain = executor.chains.emplace_back();
      hot_path.emplace_back(std::move(samples[c].hot_path));
      chain.chain = options.chains[c].name;
      chain.hot_path = latency_summary(hot_path[c], options.bootstrap);
      chain.end_to_end =
          latency_summary(RepeatedSamples(std::move(samples[c].end_to_end)), options.bootstrap);
      chain.drops = samples[c].drops;
    }
  }

  const auto base =
      std::find_if(runs.begin(), runs.end(), [](const ExecutorRuns& r) { return r.executor == "default"; });
  if (base == runs.end()) return summary;
  const auto base_index = static_cast<std::size_t>(base - runs.begin());
  for (std::size_t e = 0; e < runs.size(); ++e) {
    for (std::size_t c = 0; c < chains; ++c) {
      const RepeatedSamples& own = hot_paths[e][c];
      const RepeatedSamples& of_default = hot_paths[base_index][c];
      ChainSummary& chain = summary.executors[e].chains[c];
      if (e == base_index) {
        chain.median_to_default = chain.max_to_default = Estimate{1.0, std::nullopt};
        chain.median_minus_default = Estimate{0.0, std::nullopt};
        continue;
      }
      chain.median_to_default = ratio_of_quantiles(own, of_default, 0.5, options.bootstrap);
      chain.max_to_default = ratio_of_quantiles(own, of_default, 1.0, options.bootstrap);
      chain.median_minus_default = difference_of_quantiles(own, of_default, 0.5, options.bootstrap);
    }
  }
  return summary;
}

namespace {

using nlohmann::json;

json interval_json(const std::optional<Interval>& interval) {
  return interval ? json::array({interval->low, interval->high}) : json(nullptr);
}

json quantiles_json(const Quantiles& q) {
  return {{"n", q.n},     {"min", q.min},   {"p50", q.p50}, {"p90", q.p90},
          {"p99", q.p99}, {"p999", q.p999}, {"max", q.max}, {"mean", q.mean}};
}

json latency_json(const LatencySummary& latency) {
  json j = quantiles_json(latency.quantiles);
  j["interval"] = {{"p50", interval_json(latency.p50)},
                   {"p99", interval_json(latency.p99)},
                   {"p999", interval_json(latency.p999)},
                   {"max", interval_json(latency.max)}};
  return j;
}

json estimate_json(const std::optional<Estimate>& estimate) {
  if (!estimate) return nullptr;
  return {{"value", estimate->value}, {"interval", interval_json(estimate->interval)}};
}

json chain_json(const ChainSummary& chain) {
  return {
      {"chain", chain.chain},
      {"hot_path_latency_ms", latency_json(chain.hot_path)},
      {"end_to_end_latency_ms", latency_json(chain.end_to_end)},
      {"hot_path_drops", chain.drops},
      {"ratio_to_default",
       {{"median", estimate_json(chain.median_to_default)}, {"max", estimate_json(chain.max_to_default)}}},
      {"difference_to_default_ms", {{"median", estimate_json(chain.median_minus_default)}}}};
}

json task_json(const TaskSummary& task) {
  const bool timer = task.kind == TaskKind::timer;
  json j = {{"task", task.task},       {"kind", timer ? "timer" : "subscription"},
            {"ran", task.ran},         {"queued", task.queued},
            {"running", task.running}, {"response_ms", quantiles_json(task.response_ms)}};
  if (timer) {
    j["skipped"] = task.skipped;
    j["deadline_overruns"] = task.deadline_overruns;
  } else {
    j["overwritten"] = task.overwritten;
    j["empty"] = task.empty;
  }
  if (task.response_authors_ms) j["response_authors_ms"] = quantiles_json(*task.response_authors_ms);
  if (task.period_ms) j["period_ms"] = quantiles_json(*task.period_ms);
  return j;
}

json usage_json(const ProcessUsage& usage) {
  json cpu_use = nullptr;
  if (usage.wall.count() > 0) {
    cpu_use = 100.0 * static_cast<double>(usage.cpu_time.count()) / static_cast<double>(usage.wall.count());
  }
  return {{"cpu_time_ms", to_ms(usage.cpu_time)},
          {"wall_ms", to_ms(usage.wall)},
          {"cpu_use_percent", cpu_use},
          {"peak_memory_kib", usage.peak_memory_kib},
          {"voluntary_context_switches", usage.voluntary_switches},
          {"involuntary_context_switches", usage.involuntary_switches},
          {"stolen_ms", to_ms(usage.stolen)}};
}

json executor_json(const ExecutorSummary& executor) {
  json chains = json::array(), tasks = json::array(), unbalanced = json::array();
  for (const ChainSummary& chain : executor.chains) chains.push_back(chain_json(chain));
  for (const TaskSummary& task : executor.tasks) tasks.push_back(task_json(task));
  for (const Imbalance& i : executor.unbalanced) {
    unbalanced.push_back({{"repetition", i.repetition},
                          {"task", i.task},
                          {"accounted", i.accounted},
                          {"expected", i.expected}});
  }
  return {{"executor", executor.executor},
          {"repetitions", executor.repetitions},
          {"callbacks_executed", executor.executed},
          {"skipped", executor.skipped},
          {"overwritten", executor.overwritten},
          {"deadline_overruns", executor.deadline_overruns},
          {"lost_records", executor.lost_records},
          {"cpu_per_callback_us", executor.cpu_per_callback_us},
          {"usage", usage_json(executor.usage)},
          {"chains", std::move(chains)},
          {"tasks", std::move(tasks)},
          {"loss_equations", {{"hold", executor.unbalanced.empty()}, {"unbalanced", std::move(unbalanced)}}}};
}

}  // namespace

nlohmann::json to_json(const Summary& summary) {
  json executors = json::array();
  for (const ExecutorSummary& executor : summary.executors) executors.push_back(executor_json(executor));
  return {{"warm_up_s", to_ms(summary.warm_up) / 1e3},
          {"bootstrap",
           {{"confidence", summary.bootstrap.confidence},
            {"resamples", summary.bootstrap.resamples},
            {"seed", summary.bootstrap.seed}}},
          {"executors", std::move(executors)}};
}

}  // namespace hotpath
