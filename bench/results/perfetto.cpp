// SPDX-License-Identifier: Apache-2.0
#include "results/perfetto.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>
#include <vector>

#include "hotpath/core/events_scheduler.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath {

namespace {

using nlohmann::json;

class PerfettoWriter {
 public:
  PerfettoWriter(std::ostream& out, const TaskSet& set, const Trace& trace)
      : out_(out), set_(set), trace_(trace) {}

  void write(Time from, Time to) {
    out_ << "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[";
    find_flows(from, to);
    for (const JobRecord& r : trace_.jobs) {
      if (shown(r, from, to)) {
        job(r);
      } else if (r.outcome == Outcome::overwritten && r.job.timestamp >= from && r.job.timestamp < to) {
        marker(r, "overwritten", r.job.timestamp);
      }
      for (std::uint32_t k = 1; k <= r.job.skipped; ++k) {
        const Time timestamp = r.job.timestamp + k * set_[r.job.task].period;
        if (timestamp >= from && timestamp < to) marker(r, "skipped", timestamp);
      }
    }
    out_ << "\n]}\n";
  }

 private:
  using Key = std::pair<TaskId, std::uint64_t>;
  static Key key(JobRef job) { return {job.task, job.sequence}; }
  static bool shown(const JobRecord& r, Time from, Time to) {
    return r.outcome == Outcome::ran && r.finish >= from && r.start < to;
  }

  /// Numbers as Linux gives them: positive, none twice, and the first thread's is that of its process.
  static int pid(const JobRecord& r) { return 100 * (r.process + 1); }
  static int tid(const JobRecord& r) { return pid(r) + r.worker; }

  /// Chrome's unit; a double keeps nanoseconds over a hundred days.
  double at(Time t) const { return to_us(t - trace_.epoch); }

  void event(const JobRecord& r, const char* phase, const std::string& name, json more) {
    more.update({{"ph", phase}, {"name", name}, {"pid", pid(r)}});
    out_ << (first_ ? "\n" : ",\n") << more.dump();
    first_ = false;
  }

  /// A process and a worker have names, which come before their first event.
  void name_track(const JobRecord& r) {
    if (processes_.insert(r.process).second) {
      const std::string name =
          concat(trace_.executor, ", repetition ", trace_.repetition, ", process ", r.process);
      event(r, "M", "process_name", {{"args", {{"name", name}}}});
    }
    if (!workers_.insert({r.process, r.worker}).second) return;
    const bool events = trace_.executor.find("-r") != std::string::npos;
    const std::string name = !events ? "worker " + std::to_string(r.worker)
                             : r.worker == EventsScheduler::kTimerManagement ? "timer management thread"
                                                                             : "executor thread";
    event(r, "M", "thread_name", {{"tid", tid(r)}, {"args", {{"name", name}}}});
  }

  void job(const JobRecord& r) {
    name_track(r);
    const Task& task = set_[r.job.task];
    json args = {{"sequence", r.job.sequence},
                 {"timestamp_ms", to_ms(r.job.timestamp - trace_.epoch)},
                 {"release_ms", to_ms(r.job.release - trace_.epoch)},
                 {"response_ms", to_ms(response_time(r))}};
    if (r.job.deadline != kNever) args["deadline_ms"] = to_ms(r.job.deadline - trace_.epoch);
    event(r, "X", task.name,
          {{"cat", to_string(task.kind)},
           {"tid", tid(r)},
           {"ts", at(r.start)},
           {"dur", to_us(r.finish - r.start)},
           {"args", args}});
    flows(r);
    if (r.finish > r.job.deadline) marker(r, "deadline missed", r.finish);
  }

  /// A flow leads from the job that published to each that took the message.
  void find_flows(Time from, Time to) {
    std::set<Key> publishers;
    for (const JobRecord& r : trace_.jobs) {
      if (shown(r, from, to)) publishers.insert(key(r.job.ref()));
    }
    std::uint64_t flows = 0;
    for (const JobRecord& r : trace_.jobs) {
      const Key parent = key(r.job.parent);
      if (!shown(r, from, to) || publishers.count(parent) == 0) continue;
      arriving_[key(r.job.ref())] = ++flows;
      leaving_[parent].push_back(flows);
    }
  }

  /// An end binds to the slice before it, which thus may last no time at all.
  void flows(const JobRecord& r) {
    const auto end = [&](const char* phase, std::uint64_t id) {
      event(r, phase, "message",
            {{"cat", "flow"}, {"id", id}, {"bp", "e"}, {"tid", tid(r)}, {"ts", at(r.start)}});
    };
    if (const auto arriving = arriving_.find(key(r.job.ref())); arriving != arriving_.end()) {
      end("f", arriving->second);
    }
    if (const auto leaving = leaving_.find(key(r.job.ref())); leaving != leaving_.end()) {
      for (const std::uint64_t id : leaving->second) end("s", id);
    }
  }

  void marker(const JobRecord& r, const char* what, Time when) {
    event(r, "i", concat(what, ": ", set_[r.job.task].name),
          {{"s", "p"}, {"cat", what}, {"tid", pid(r)}, {"ts", at(when)}});
  }

  std::ostream& out_;
  const TaskSet& set_;
  const Trace& trace_;
  std::map<Key, std::uint64_t> arriving_;
  std::map<Key, std::vector<std::uint64_t>> leaving_;
  std::set<std::uint16_t> processes_;
  std::set<std::pair<std::uint16_t, std::uint16_t>> workers_;
  bool first_ = true;
};

}  // namespace

void write_perfetto(std::ostream& out, const TaskSet& set, const Trace& trace, Time from, Time to) {
  PerfettoWriter(out, set, trace).write(from, to);
}

}  // namespace hotpath
