// SPDX-License-Identifier: Apache-2.0
#include "results/perfetto.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>
#include <utility>

#include "hotpath/core/registry.hpp"
#include "hotpath/core/utf8.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "results/measures.hpp"

namespace hotpath::results {

using nlohmann::json;

namespace {

double us(Time time) { return to_us(time.time_since_epoch()); }
/// Ids are positive and unique; that of a process is that of its first thread.
int process_of(const JobRecord& job) { return 100 * (job.process + 1); }
int thread_of(const JobRecord& job) { return process_of(job) + job.worker; }

/// Of a worker that runs jobs. Of the timer management threads, only those of release-and-execute do.
std::string worker_name(const std::string& executor, unsigned worker) {
  const ExecutorEntry* const entry = find_executor(ExecutorLabel(executor).name);
  if (entry == nullptr || entry->traits.family == Family::wait_set)  // none: a deployment
    return "worker " + std::to_string(worker);
  const bool manages_timers =
      entry->traits.timers == TimerHandling::release_and_execute && worker == entry->traits.timer_worker();
  return manages_timers ? "timer management thread" : "executor thread";
}

bool is_shown(const JobRecord& r, const TraceWindow& window) {
  if (r.outcome == Outcome::ran) return r.finish >= window.from && r.start < window.to;
  return (r.outcome == Outcome::skipped || r.outcome == Outcome::overwritten) &&
         r.job.timestamp >= window.from && r.job.timestamp < window.to;
}

/// Writes the events of jobs.
class Events {
 public:
  Events(std::ostream& out, const TaskSet& tasks, const TraceWindow& window)
      : out_(out), tasks_(tasks), window_(window) {}

  /// A job that ran, and the names of its process and thread if they are new.
  void add_slice(const JobRecord& r) {
    if (named_.insert(-process_of(r)).second) {
      const std::string name =
          program::concat(window_.executor, ", repetition ", window_.repetition, ", process ", r.process);
      write(r, "process_name", {{"ph", "M"}, {"args", {{"name", printable(name)}}}});
    }
    if (named_.insert(thread_of(r)).second) {
      const std::string name = worker_name(window_.executor, r.worker);
      write(r, "thread_name", {{"ph", "M"}, {"tid", thread_of(r)}, {"args", {{"name", name}}}});
    }
    json args = {{"sequence", r.job.sequence},
                 {"timestamp_ms", us(r.job.timestamp) / 1e3},
                 {"release_ms", us(r.job.release) / 1e3}};
    if (r.job.deadline != kNever) args["deadline_ms"] = us(r.job.deadline) / 1e3;
    const Task& task = tasks_[r.job.task];
    add(r, task.name, thread_of(r), r.start, to_string(task.kind),
        {{"ph", "X"}, {"dur", to_us(r.duration())}, {"args", args}});
    if (overruns_deadline(task, r.response_time())) add_marker(r, r.finish, "deadline missed");
  }

  /// An instant of a task.
  void add_marker(const JobRecord& r, Time at, const std::string& what) {
    add(r, what + ": " + tasks_[r.job.task].name, process_of(r), at, what, {{"ph", "i"}, {"s", "p"}});
  }

  /// The end of a message at the slice that was added last: `s`, its beginning, or `f`.
  void add_flow(const JobRecord& r, const char* phase, std::size_t id) {
    add(r, "message", thread_of(r), r.start, "flow", {{"ph", phase}, {"id", id}, {"bp", "e"}});
  }

 private:
  void add(const JobRecord& r, const std::string& name, int thread, Time at, const std::string& category,
           json event) {
    event.update({{"tid", thread}, {"ts", us(at)}, {"cat", category}});
    write(r, name, std::move(event));
  }
  void write(const JobRecord& r, const std::string& name, json event) {
    event.update({{"name", printable(name)}, {"pid", process_of(r)}});
    out_ << std::exchange(separator_, ",\n") << event.dump(-1, ' ', false, json::error_handler_t::replace);
  }

  std::ostream& out_;
  const TaskSet& tasks_;
  const TraceWindow& window_;
  std::set<int> named_;  // threads, and processes with a minus
  const char* separator_ = "";
};

}  // namespace

void write_perfetto(std::ostream& out, const StoredRun& run, const TraceWindow& window) {
  static_cast<void>(run.run(window.executor, window.repetition));  // throws if it did not run
  std::ifstream in = run.open("jobs.csv");
  std::vector<JobRecord> jobs;
  std::map<std::pair<TaskId, std::uint64_t>, std::size_t> ran;
  for_each_job(in, run.tasks(), (run.folder() / "jobs.csv").string(), [&](const JobRow& row) {
    const JobRecord& r = row.record;
    if (row.executor != window.executor || row.repetition != window.repetition || !is_shown(r, window))
      return;
    if (r.outcome == Outcome::ran) ran[{r.job.task, r.job.sequence}] = jobs.size();
    jobs.push_back(r);
  });
  out << "{\"displayTimeUnit\": \"ms\", \"traceEvents\": [\n";
  Events events(out, run.tasks(), window);
  std::map<std::size_t, std::vector<std::size_t>> readers;  // by job
  const auto parent_of = [&](const JobRecord& job) {
    return ran.find({job.job.parent.task, job.job.parent.sequence});
  };
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (jobs[i].outcome != Outcome::ran) continue;
    if (const auto parent = parent_of(jobs[i]); parent != ran.end()) readers[parent->second].push_back(i);
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobRecord& job = jobs[i];
    if (job.outcome != Outcome::ran) {
      events.add_marker(job, job.job.timestamp, to_string(job.outcome));
      continue;
    }
    events.add_slice(job);
    if (parent_of(job) != ran.end()) events.add_flow(job, "f", i + 1);
    for (const std::size_t reader : readers[i]) events.add_flow(job, "s", reader + 1);
  }
  out << "\n]}\n";
}

}  // namespace hotpath::results
