// SPDX-License-Identifier: Apache-2.0
#include "live/collected_trace.hpp"

#include <algorithm>

#include "hotpath/reference_system/chain_observation.hpp"
#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// The records of one worker. A job that ends after the run, or that another thread kept from its start
/// until then, counts as running. Its CPU time includes time after the run, so it is left out.
void add_jobs(const RecordLog<JobRecord>& log, const std::vector<std::uint16_t>& workers,
              std::uint16_t process, Trace& trace) {
  trace.lost_records += log.lost();
  for (JobRecord record : log.contents()) {
    record.process = process;
    record.worker = workers[record.worker];
    const bool late = record.finish > trace.end || record.start >= trace.end;
    if (record.outcome == Outcome::ran && late) {
      record.outcome = Outcome::running;
      record.cpu_time = Duration(-1);
    }
    trace.jobs.push_back(record);
  }
}

Time instant(const JobRecord& j) {
  return j.outcome == Outcome::queued || j.outcome == Outcome::overwritten ? j.job.timestamp : j.start;
}

/// Above the wake-up latency of an ordinary kernel.
constexpr Duration kLate = std::chrono::milliseconds(1);

bool has_timer_thread(const setup::ExecutorSpec& executor, TaskId task) {
  const setup::ExecutorSpec& part = setup::parts(executor)[executor_of(executor, task)];
  // On rclcpp, the start of a job is the earliest instant known of its own executors' jobs.
  const bool known =
      part.stack != setup::Stack::rclcpp || part.entry->traits.family == Family::priority_events;
  return known && part.entry->traits.timers == TimerHandling::release_only;
}

}  // namespace

std::vector<std::uint16_t> workers_of(const Plan& plan, std::uint32_t process) {
  std::vector<std::uint16_t> numbers;
  for (const std::size_t e : parts_in(plan, process)) {
    const setup::ExecutorSpec& part = setup::parts(plan.executor)[e];
    for (std::uint32_t w = 0; w < worker_count(*part.entry, part.scheduler); ++w)
      numbers.push_back(static_cast<std::uint16_t>(part.first_worker + w));
  }
  return numbers;
}

Time end_of_run(Time stopped, Time planned, const std::deque<RunMemory>& memories) {
  Time end = stopped;
  for (const RunMemory& memory : memories) {
    for (const RecordLog<JobRecord>& log : memory.jobs()) {
      for (const JobRecord& record : log.contents()) {
        if (record.started()) end = std::max(end, record.start + Duration(1));
      }
    }
  }
  return std::min(end, planned);
}

Trace empty_trace(const Plan& plan) {
  Trace trace;
  trace.executor = plan.executor.label;
  trace.repetition = plan.repetition;
  trace.published.assign(plan.tasks.set.size(), 0);
  return trace;
}

Trace collected_trace(const Plan& plan, const std::deque<RunMemory>& memories, Time epoch, Time end) {
  Trace trace = empty_trace(plan);
  trace.epoch = epoch;
  trace.end = std::max(end, epoch);
  std::vector<ChainObservation> observations;
  for (std::uint32_t p = 0; p < memories.size(); ++p) {
    const std::vector<std::uint16_t> workers = workers_of(plan, p);
    for (const auto& log : memories[p].jobs()) {
      add_jobs(log, workers, static_cast<std::uint16_t>(p), trace);
    }
    for (const auto& log : memories[p].chains()) {
      trace.lost_records += log.lost();
      const auto contents = log.contents();
      observations.insert(observations.end(), contents.begin(), contents.end());
    }
    for (TaskId id = 0; id < trace.published.size(); ++id) {
      trace.published[id] += memories[p].published()[id].load();
    }
  }
  std::ranges::stable_sort(trace.jobs, {}, instant);
  std::ranges::stable_sort(observations, {}, &ChainObservation::sink_start);
  trace.chains = join_chains(*plan.graph, plan.tasks, trace, observations);
  return trace;
}

std::string left_grid(const TaskSet& set, const setup::ExecutorSpec& executor,
                      const results::Repetition& repetition) {
  const std::vector<TaskAccount> accounts = account(set, repetition.trace);
  std::vector<std::uint64_t> late(set.size(), 0);
  std::vector<Duration> latest(set.size());
  for (const JobRecord& r : repetition.trace.jobs) {
    const TaskId id = r.job.task;
    if (set[id].kind != TaskKind::timer || !r.started() || !has_timer_thread(executor, id)) continue;
    const Duration delay = r.job.release - r.job.timestamp;
    late[id] += delay > kLate;
    latest[id] = std::max(latest[id], delay);
  }
  const auto times = [&](const TaskAccount& a) { return a[Outcome::skipped] + late[a.task]; };
  const auto worst = std::ranges::max_element(accounts, {}, times);
  if (worst == accounts.end() || times(*worst) == 0) return "";
  std::string text = program::concat(executor.label, ", repetition ", repetition.trace.repetition,
                                     ": timers left the grid of their given phases: ", set[worst->task].name,
                                     " skipped ", (*worst)[Outcome::skipped], " of ", worst->accounted(),
                                     " timestamps and was released over ", to_ms(kLate), " ms late ",
                                     late[worst->task], " times");
  if (late[worst->task] > 0)
    text += program::concat(", at most ", program::fixed(to_ms(latest[worst->task]), 1), " ms");
  if (const auto off = std::ranges::count_if(accounts, times); off > 1)
    text += program::concat("; and ", off - 1, " more");
  return text + ". Guarantees for these phases assume that timers are on time.";
}

}  // namespace hotpath::live
