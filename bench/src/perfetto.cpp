// SPDX-License-Identifier: Apache-2.0
#include "perfetto.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "hotpath/core/events_scheduler.hpp"

namespace hotpath {

namespace {

using nlohmann::json;

/// Chrome's unit; a double keeps nanoseconds over a hundred days.
double us(Duration d) { return static_cast<double>(d.count()) / 1e3; }

class PerfettoWriter {
 public:
  PerfettoWriter(std::ostream& out, const TaskSet& set, const Trace& trace)
      : out_(out), set_(set), trace_(trace) {}

  void write(Time from, Time to) {
    out_ << "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[";
    for (const JobRecord& r : trace_.jobs) {
      if (ran(r) && r.finish >= from && r.start < to) shown_.emplace(key(r.job.ref()), &r);
    }
    for (const JobRecord& r : trace_.jobs) {
      if (ran(r) && r.finish >= from && r.start < to) {
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
  static bool ran(const JobRecord& r) { return r.outcome == Outcome::ran; }

  double at(Time t) const { return us(t - trace_.epoch); }

  void event(const json& e) {
    out_ << (first_ ? "\n" : ",\n") << e.dump();
    first_ = false;
  }

  /// A process and a worker have names, which stand before their first event.
  void name_track(const JobRecord& r) {
    if (processes_.insert(r.process).second) {
      const std::string name = trace_.executor + ", repetition " + std::to_string(trace_.repetition) +
                               ", process " + std::to_string(r.process);
      event({{"ph", "M"}, {"name", "process_name"}, {"pid", r.process}, {"args", {{"name", name}}}});
    }
    if (!workers_.insert({r.process, r.worker}).second) return;
    const bool events = trace_.executor.find("-r") != std::string::npos;
    const std::string name = !events ? "worker " + std::to_string(r.worker)
                             : r.worker == EventsScheduler::kTimerManagement ? "timer management thread"
                                                                             : "executor thread";
    event({{"ph", "M"},
           {"name", "thread_name"},
           {"pid", r.process},
           {"tid", r.worker},
           {"args", {{"name", name}}}});
  }

  void job(const JobRecord& r) {
    name_track(r);
    const Task& task = set_[r.job.task];
    json args = {{"sequence", r.job.sequence},
                 {"timestamp_ms", to_ms(r.job.timestamp - trace_.epoch)},
                 {"release_ms", to_ms(r.job.release - trace_.epoch)},
                 {"response_ms", to_ms(r.finish - r.job.timestamp)}};
    if (r.job.deadline != kNever) args["deadline_ms"] = to_ms(r.job.deadline - trace_.epoch);
    event({{"ph", "X"},
           {"name", task.name},
           {"cat", task.kind == TaskKind::timer ? "timer" : "subscription"},
           {"pid", r.process},
           {"tid", r.worker},
           {"ts", at(r.start)},
           {"dur", us(r.finish - r.start)},
           {"args", args}});
    if (r.finish > r.job.deadline) marker(r, "deadline missed", r.finish);
    flow(r);
  }

  /// Both ends bind to the slice that encloses them.
  void flow(const JobRecord& r) {
    const auto parent = shown_.find(key(r.job.parent));
    if (parent == shown_.end()) return;
    const JobRecord& from = *parent->second;
    ++flows_;
    const auto end = [&](const char* phase, const JobRecord& of) {
      event({{"ph", phase},
             {"name", "message"},
             {"cat", "flow"},
             {"id", flows_},
             {"bp", "e"},
             {"pid", of.process},
             {"tid", of.worker},
             {"ts", at(of.start)}});
    };
    end("s", from);
    end("f", r);
  }

  void marker(const JobRecord& r, const char* what, Time when) {
    event({{"ph", "i"},
           {"s", "p"},
           {"name", std::string(what) + ": " + set_[r.job.task].name},
           {"cat", what},
           {"pid", r.process},
           {"tid", 0},
           {"ts", at(when)}});
  }

  std::ostream& out_;
  const TaskSet& set_;
  const Trace& trace_;
  std::map<Key, const JobRecord*> shown_;
  std::set<std::uint16_t> processes_;
  std::set<std::pair<std::uint16_t, std::uint8_t>> workers_;
  std::uint64_t flows_ = 0;
  bool first_ = true;
};

}  // namespace

void write_perfetto(std::ostream& out, const TaskSet& set, const Trace& trace, Time from, Time to) {
  PerfettoWriter(out, set, trace).write(from, to);
}

}  // namespace hotpath
