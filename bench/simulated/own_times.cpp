// SPDX-License-Identifier: Apache-2.0
#include "simulated/own_times.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/exploration.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::simulated {

Trace with_own_times(Trace trace, unsigned cores, std::optional<Worker> raised) {
  const auto is_above = [&](std::size_t i) { return trace.jobs[i].worker == raised; };
  std::vector<double> own_ns(trace.jobs.size(), 0);
  std::vector<std::size_t> begun;
  Time now{};
  for_each_change(trace, [&](std::size_t job, Time at, bool begins) {
    if (trace.jobs[job].finish <= trace.jobs[job].start) return;
    const auto elapsed = static_cast<double>((at - now).count());
    const auto above = static_cast<double>(std::ranges::count_if(begun, is_above));
    const double others = static_cast<double>(begun.size()) - above;
    const double share = others > 0 ? std::clamp((cores - above) / others, 0.0, 1.0) : 0;
    for (const std::size_t i : begun) own_ns[i] += elapsed * (is_above(i) ? 1 : share);
    now = at;
    begins ? begun.push_back(job) : void(std::erase(begun, job));
  });
  for (std::size_t i = 0; i < trace.jobs.size(); ++i) {
    JobRecord& r = trace.jobs[i];
    if (r.outcome != Outcome::ran) continue;
    const bool measured = r.cpu_time >= Duration{};
    r.finish = r.start + (measured ? r.cpu_time : Duration(std::llround(own_ns[i])));
  }
  return trace;
}

OwnCosts own_costs(const Trace& trace, unsigned cores) {
  std::map<std::uint32_t, Time> free_at;  // by thread
  Duration dispatches{};
  std::vector<Duration> wake_ups;
  std::int64_t dispatched = 0;
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran) continue;
    const auto [last, is_first] = free_at.try_emplace(cores == 1 ? 0U : r.worker, r.finish);
    if (is_first) continue;
    const Time free = std::exchange(last->second, std::max(last->second, r.finish));
    if (r.start < free) continue;  // it preempted a job
    if (r.job.timestamp > free) {
      wake_ups.push_back(r.lateness());
    } else {
      dispatches += r.start - free;
      ++dispatched;
    }
  }
  OwnCosts costs;
  if (dispatched > 0) costs.dispatch = dispatches / dispatched;
  if (!wake_ups.empty()) {
    std::ranges::sort(wake_ups);
    costs.wake_up = std::max(Duration{}, wake_ups[wake_ups.size() / 2] - costs.dispatch);
  }
  return costs;
}

std::unique_ptr<ExecutionTimes> replayed_times(const results::StoredRun& run, const GraphTasks& tasks,
                                               const std::string& executor, std::uint32_t repetition) {
  const Trace& measured = run.trace(executor, repetition);
  // Nodes that work until an instant of the clock count preemption as work.
  if (run.record().work == WorkMode::wall) {
    return std::make_unique<ReplayedTimes>(tasks.set, working_jobs(tasks, measured));
  }
  const ExecutorEntry* const entry = find_executor(results::ExecutorLabel(executor).name);
  const auto lacks_cpu_time = [](const JobRecord& r) {
    return r.outcome == Outcome::ran && r.cpu_time < Duration{};
  };
  if (entry == nullptr && std::ranges::any_of(measured.jobs, lacks_cpu_time)) {
    throw program::UsageError(program::concat(
        "deployment ", executor, " in ", run.folder().string(),
        " has no CPU times of its jobs, which preempt each other; measure with --work cpu_time"));
  }
  Graph machine;
  if (run.record().simulation) machine.platform = run.record().simulation->platform;
  std::optional<Worker> raised;
  if (entry != nullptr && entry->traits.timers == TimerHandling::release_and_execute &&
      make_platform(machine, *entry).raised_releaser)
    raised = entry->traits.timer_worker();
  return std::make_unique<ReplayedTimes>(
      tasks.set, working_jobs(tasks, with_own_times(measured, run.record().cores(), raised)));
}

namespace {

/// Times, release delays and deliveries of single jobs.
class ListedTimes final : public ExecutionTimes, public ReleaseDelays, public Deliveries {
 public:
  ListedTimes(const std::string& file, const TaskSet& set) : file_(file) {
    CsvReader rows(std::filesystem::path(file), CsvLayout::by_hand);
    std::string header = program::joined(std::span(kListedColumns).first<3>(), ",");
    const auto optional_column = [&](const char* name) {
      const std::optional<std::size_t> column = rows.find_column(name);
      if (column) header += program::concat(",", name);
      return column;
    };
    const auto delay = optional_column(kListedColumns[3]), round = optional_column(kListedColumns[4]),
               delivery = optional_column(kListedColumns[5]);
    rows.require_header(header);
    std::map<std::string, TaskId, std::less<>> ids;
    for (const Task& task : set.tasks) {
      ids.emplace(task.name, static_cast<TaskId>(names_.size()));
      names_.push_back(task.name);
    }
    while (rows.next()) {
      const auto id = ids.find(rows.text(0));
      if (id == ids.end())
        rows.fail(program::concat("the graph has no task ", rows.text(0)), "give task names");
      const auto sequence = rows.number<std::uint64_t>(1);
      const Task& task = set[id->second];
      const Duration time = within(rows, 2, "execution time", task, task.wcet,
                                   program::concat("its worst case, ", task.wcet.count()));
      const auto [job, is_new] = jobs_.try_emplace({id->second, sequence});
      if (!is_new)
        rows.fail(program::concat("job ", sequence, " of ", task.name, " is listed twice"), "keep one row");
      job->second.time = time;
      if (delay)
        job->second.delay = within(rows, *delay, "release delay", task, task.release_jitter,
                                   "the `release_jitter_ms` of the timer in the graph");
      if (delivery) job->second.delivery = rows.nanoseconds(*delivery);
      if (round) job->second.end_round = rows.number<std::uint32_t>(*round);
    }
    has_deliveries_ = delivery && !jobs_.empty();
  }
  [[nodiscard]] Duration of(TaskId subscription, std::uint64_t number, Duration longest) const override {
    return std::min(longest, given({subscription, number}).delivery.value_or(longest));
  }
  [[nodiscard]] const Deliveries* deliveries() const override { return has_deliveries_ ? this : nullptr; }
  [[nodiscard]] std::uint32_t end_round(const Job& job) const override {
    return given(job.ref()).end_round.value_or(0);
  }
  [[nodiscard]] const ReleaseDelays* release_delays() const override { return this; }
  [[nodiscard]] Time due(JobRef job, Time timestamp) const override {
    return timestamp + given(job).delay.value_or(Duration{});
  }
  [[nodiscard]] Duration of(const Job& job) const override {
    if (const std::optional<Duration> time = given(job.ref()).time) return *time;
    throw InputError(file_, 0,
                     program::concat("job ", job.sequence, " of ", names_[job.task], " is not listed"),
                     "list every job that starts, or shorten the run");
  }

 private:
  static Duration within(const CsvReader& rows, std::size_t column, const char* what, const Task& task,
                         Duration most, const std::string& limit) {
    const Duration value = rows.nanoseconds(column);
    if (value >= Duration{} && value <= most) return value;
    rows.fail(program::concat("the ", what, " of ", task.name, " is ", rows.text(column)),
              "give 0 or more, and at most " + limit);
  }
  [[nodiscard]] GivenJob given(JobRef job) const {
    const auto listed = jobs_.find({job.task, job.sequence});
    return listed == jobs_.end() ? GivenJob{} : listed->second;
  }

  const std::string file_;
  std::vector<std::string> names_;
  GivenJobs jobs_;
  bool has_deliveries_ = false;
};

}  // namespace

std::unique_ptr<ExecutionTimes> listed_times(const std::string& file, const TaskSet& set) {
  return std::make_unique<ListedTimes>(file, set);
}

std::unique_ptr<ExecutionTimes> times_again(const results::StoredRun& run, const setup::StoredSystem& system,
                                            const GraphTasks& tasks, const std::string& executor,
                                            std::uint32_t repetition) {
  const std::uint64_t seed = system.options.seed + repetition;
  if (!system.times) return replayed_times(run, tasks, executor, repetition);
  const auto& [model, replay, listed] = *system.times;
  if (model) return execution_times_of(system.graph, tasks, seed);
  if (!replay.empty() && std::filesystem::exists(std::filesystem::path(replay) / "jobs.csv")) {
    results::StoredRun replayed(replay, kReplayOption);
    replayed.load(tasks.set);
    return times_of_run(replayed, tasks, executor, repetition, seed);
  }
  if (!listed.empty()) {
    const auto kept = results::kept_input(run, "times");
    if (kept || std::filesystem::exists(listed))
      return listed_times(kept ? kept->string() : listed, tasks.set);
  }
  return replayed_times(run, tasks, executor, repetition);
}

std::unique_ptr<ExecutionTimes> times_of_run(const results::StoredRun& run, const GraphTasks& tasks,
                                             const std::string& executor, std::uint32_t repetition,
                                             std::uint64_t seed) {
  if (run.record().kind == results::RunKind::simulated) {
    static_cast<void>(run.run(executor, repetition));  // throws if it did not run
    const setup::StoredSystem system = run.check([&] { return setup::stored_system(run); });
    return times_again(run, system, tasks, executor, repetition);
  }
  return with_drawn_releases(replayed_times(run, tasks, executor, repetition), tasks, seed);
}

}  // namespace hotpath::simulated
