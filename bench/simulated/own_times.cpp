// SPDX-License-Identifier: Apache-2.0
#include "simulated/own_times.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/events_scheduler.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "results/kept_inputs.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::simulated {

Trace with_own_times(Trace trace, unsigned cores, bool raised) {
  struct Change {
    Time at;
    bool begins;
    std::size_t job;
  };
  std::vector<Change> changes;
  for (std::size_t i = 0; i < trace.jobs.size(); ++i) {
    const JobRecord& r = trace.jobs[i];
    if (r.outcome != Outcome::ran || r.finish <= r.start) continue;
    changes.push_back({r.start, true, i});
    changes.push_back({r.finish, false, i});
  }
  std::ranges::sort(changes, {}, [](const Change& c) { return std::pair(c.at, c.begins); });
  const auto is_above = [&](std::size_t i) {
    return raised && trace.jobs[i].worker == EventsScheduler::kTimerManagement;
  };
  std::vector<double> own_ns(trace.jobs.size(), 0);
  std::vector<std::size_t> begun;
  Time now{};
  for (const Change& change : changes) {
    const auto elapsed = static_cast<double>((change.at - now).count());
    const auto above = static_cast<double>(std::ranges::count_if(begun, is_above));
    const double others = static_cast<double>(begun.size()) - above;
    const double share = others > 0 ? std::clamp((cores - above) / others, 0.0, 1.0) : 0;
    for (const std::size_t i : begun) {
      own_ns[i] += elapsed * (is_above(i) ? 1 : share);
    }
    now = change.at;
    if (change.begins) {
      begun.push_back(change.job);
    } else {
      begun.erase(std::ranges::find(begun, change.job));
    }
  }
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
    const auto middle = wake_ups.begin() + static_cast<std::ptrdiff_t>(wake_ups.size() / 2);
    std::ranges::nth_element(wake_ups, middle);
    costs.wake_up = std::max(Duration{}, *middle - costs.dispatch);
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
  const bool raised = entry != nullptr && make_platform(machine, *entry).raised_releaser;
  return std::make_unique<ReplayedTimes>(
      tasks.set, working_jobs(tasks, with_own_times(measured, run.record().cores(), raised)));
}

namespace {

Duration release_delay(const CsvReader& rows, std::size_t column, const Task& task) {
  const Duration delay = rows.nanoseconds(column);
  if (delay < Duration{} || delay > task.release_jitter) {
    rows.fail("the release delay of " + task.name + " is " + std::string(rows.text(column)),
              "give 0 or more, and at most the `release_jitter_ms` of the timer in the graph");
  }
  return delay;
}

/// Times and release delays of single jobs.
class ListedTimes final : public ExecutionTimes, public ReleaseDelays, public Deliveries {
 public:
  ListedTimes(std::string file, const TaskSet& set) : file_(std::move(file)), times_(set.size()) {
    for (const Task& task : set.tasks) names_.push_back(task.name);
  }
  /// Whether the job was not listed before.
  bool add(JobRef job, Duration time) { return times_[job.task].emplace(job.sequence, time).second; }
  void add_delay(JobRef job, Duration delay) { delays_[{job.task, job.sequence}] = delay; }
  void add_delivery(JobRef job, Duration delay) { deliveries_[{job.task, job.sequence}] = delay; }
  [[nodiscard]] Duration of(TaskId subscription, std::uint64_t number, Duration longest) const override {
    const auto listed = deliveries_.find({subscription, number});
    return listed == deliveries_.end() ? longest : std::min(longest, listed->second);
  }
  [[nodiscard]] const Deliveries* deliveries() const override { return deliveries_.empty() ? nullptr : this; }
  void add_round(JobRef job, std::uint32_t round) { rounds_[{job.task, job.sequence}] = round; }
  [[nodiscard]] std::uint32_t end_round(const Job& job) const override {
    const auto listed = rounds_.find({job.task, job.sequence});
    return listed == rounds_.end() ? 0 : listed->second;
  }
  [[nodiscard]] const ReleaseDelays* release_delays() const override { return this; }
  [[nodiscard]] Time due(JobRef job, Time timestamp) const override {
    const auto listed = delays_.find({job.task, job.sequence});
    return listed == delays_.end() ? timestamp : timestamp + listed->second;
  }
  [[nodiscard]] Duration of(const Job& job) const override {
    const auto listed = times_[job.task].find(job.sequence);
    if (listed != times_[job.task].end()) return listed->second;
    throw InputError(file_, 0,
                     program::concat("job ", job.sequence, " of ", names_[job.task], " is not listed"),
                     "list every job that starts, or shorten the run");
  }

 private:
  const std::string file_;
  std::vector<std::string> names_;
  std::vector<std::map<std::uint64_t, Duration>> times_;  // by task, then by sequence
  std::map<std::pair<TaskId, std::uint64_t>, Duration> delays_, deliveries_;
  std::map<std::pair<TaskId, std::uint64_t>, std::uint32_t> rounds_;
};

}  // namespace

std::unique_ptr<ExecutionTimes> listed_times(const std::string& file, const TaskSet& set) {
  CsvReader rows(std::filesystem::path(file), CsvLayout::by_hand);
  const std::optional<std::size_t> delays = rows.find_column(kListedDelay);
  const std::optional<std::size_t> rounds = rows.find_column(kListedRound);
  std::string header(kListedColumns);
  if (delays) header += program::concat(",", kListedDelay);
  if (rounds) header += program::concat(",", kListedRound);
  const std::optional<std::size_t> deliveries = rows.find_column(kListedDelivery);
  if (deliveries) header += program::concat(",", kListedDelivery);
  rows.require_header(header);
  auto times = std::make_unique<ListedTimes>(file, set);
  std::map<std::string, TaskId, std::less<>> ids;
  for (TaskId id = 0; id < set.size(); ++id) ids[set[id].name] = id;
  while (rows.next()) {
    const auto id = ids.find(rows.text(0));
    if (id == ids.end())
      rows.fail(program::concat("the graph has no task ", rows.text(0)), "give task names");
    const Task& task = set[id->second];
    const JobRef job{id->second, rows.number<std::uint64_t>(1)};
    const Duration time = rows.nanoseconds(2);
    if (time < Duration{} || time > task.wcet) {
      rows.fail(program::concat("the execution time of ", task.name, " is ", rows.text(2)),
                program::concat("give 0 or more, and at most its worst case, ", task.wcet.count()));
    }
    if (!times->add(job, time))
      rows.fail(program::concat("job ", job.sequence, " of ", task.name, " is listed twice"), "keep one row");
    if (delays) times->add_delay(job, release_delay(rows, *delays, task));
    if (deliveries) times->add_delivery(job, rows.nanoseconds(*deliveries));
    if (rounds) times->add_round(job, rows.number<std::uint32_t>(*rounds));
  }
  return times;
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
