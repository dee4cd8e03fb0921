// SPDX-License-Identifier: Apache-2.0
#include "live/repetition_runner.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>

#include "hotpath/live/clock.hpp"
#include "live/collected_trace.hpp"
#include "live/rclcpp_process.hpp"
#include "machine/proc_files.hpp"
#include "machine/shared_memory_watch.hpp"
#include "program/child_process.hpp"
#include "program/interrupt.hpp"
#include "program/text.hpp"
#include "results/schedule.hpp"

namespace hotpath::live {

namespace {

using Kind = ChannelMessage::Kind;

/// The coordinator's side of the publishing process, whose failure does not end the repetition.
class Publisher {
 public:
  explicit Publisher(ForkedProcess process) : process_(std::move(process)) {}

  /// Waits until the process is ready or has failed: its set-up must not overlap the measurement.
  void await_ready(Time limit) { receive(Kind::matched, limit); }
  void begin(Time epoch, Time end) { process_.channel.send({Kind::begin, {to_ns(epoch), to_ns(end)}}); }
  /// Everything is recorded; the run ended at `end`.
  void stop(Time end) { process_.channel.send({Kind::stop, {to_ns(end)}}); }
  /// Waits for the end of the process, for a bounded time, and adds a warning for each problem.
  void finish(std::vector<std::string>& warnings) {
    receive(Kind::done, now() + kTimeToEnd);
    const std::string cause = cause_of_end();
    if (failure_.empty()) failure_ = cause;
    if (!failure_.empty())
      warnings.push_back("Live publishing stopped (" + failure_ + "); the run itself continued.");
    if (samples_lost_ > 0) {
      warnings.push_back(
          program::concat("Live publishing: ", samples_lost_,
                          " chain samples may not have reached every reader: a reader was too slow."));
    }
  }

 private:
  /// At nice 19 it gets little of a busy processor, and it flushes for a second.
  static constexpr Duration kTimeToEnd = std::chrono::seconds(5);

  /// Waits for `kind`, the end of the process, or `limit`.
  void receive(Kind kind, Time limit) {
    while (process_.id > 0 && failure_.empty() && now() < limit) {
      const auto message = process_.channel.receive(limit);
      if (!message) continue;
      if (message->kind == Kind::failed) failure_ = message->text.data();
      if (message->kind == Kind::done) samples_lost_ = message->number[0];
      if (message->kind == kind || message->kind == Kind::closed) return;
    }
  }

  std::string cause_of_end() {
    if (process_.id < 0) return "its process could not be started";
    int status = 0;
    const Time limit = now() + kTimeToEnd;
    while (program::await_process(process_.id, &status, WNOHANG) == 0) {
      if (now() < limit) {
        usleep(1000);
        continue;
      }
      kill(process_.id, SIGKILL);
      program::await_process(process_.id, nullptr);
      return "its process did not end in time and was killed";
    }
    return status == 0 ? "" : "its process " + program::how_it_ended(status);
  }

  ForkedProcess process_;
  std::int64_t samples_lost_ = 0;
  std::string failure_;
};

/// The processes of one repetition as the coordinator sees them.
class Coordinator {
 public:
  Coordinator(const Plan& plan, const std::function<void(Duration)>& progress)
      : plan_(plan),
        progress_(progress),
        process_of_node_(plan.executor.entry ? assign_processes(*plan.graph, plan.processes)
                                             : plan.executor.plan.process_of(*plan.graph, plan.tasks)) {
    for (std::uint32_t p = 0; p < plan.processes; ++p) memories_.emplace_back(memory_size(plan, p));
  }

  Result run() {
    for (std::uint32_t p = 0; p < plan_.processes; ++p) start(p);
    start_publisher();
    execute();
    end_all();
    if (publisher_) publisher_->stop(end_);
    collect();
    if (publisher_) publisher_->finish(result_.warnings);
    result_.measured = began_ && result_.failure.empty();
    return std::move(result_);
  }

 private:
  void start(std::uint32_t process) {
    ForkedProcess child = fork_process([&](const Channel& coordinator) {
      children_.clear();  // closes the channels of the other processes
      // When memory runs out, Linux kills this process; the coordinator survives and reports it.
      std::ofstream("/proc/self/oom_score_adj") << 500;
      if (plan_.executor.stack == setup::Stack::rclcpp)
        return become_rclcpp_runner(plan_, memories_[process], coordinator);
      return run_process(plan_, process, process_of_node_, memories_, coordinator);
    });
    if (child.id < 0) {
      fail("cannot start a process: " + std::string(std::strerror(errno)));
    } else {
      children_.push_back(std::move(child));
    }
  }

  /// If the publisher cannot start, the run continues without it.
  void start_publisher() {
    if (plan_.published == nullptr || !result_.failure.empty()) return;
    publisher_.emplace(fork_process([&](const Channel& coordinator) {
      children_.clear();
      return run_publisher_process(plan_, memories_, coordinator);
    }));
  }

  void execute() {
    if (!result_.failure.empty()) return;
    // After its own limit a process reports the missing endpoint, so this limit is a second longer.
    if (!await_all(Kind::matched, now() + set_up_limit(plan_) + std::chrono::seconds(1))) return;
    note_shared_memory();
    if (publisher_) publisher_->await_ready(now() + plan_.time_out);
    // Enough for all processes to start their threads before the epoch.
    epoch_ = now() + std::chrono::milliseconds(50 + 10 * plan_.processes);
    end_ = epoch_ + plan_.length;
    began_ = true;
    before_ = machine::processor_times(plan_.cpus);
    tell_all(Kind::begin, {to_ns(epoch_), to_ns(end_)});
    if (publisher_) publisher_->begin(epoch_, end_);
    if (!await_all(Kind::begun, end_ + plan_.time_out)) return;
    if (!await_all(Kind::stopped, end_ + plan_.time_out)) return;
    end_ = end_of_run(stopped_, end_, memories_);
    tell_all(Kind::settle, {to_ns(end_)});
    if (await_all(Kind::done, now() + plan_.time_out)) tell_all(Kind::leave);
    note_disturbances();
  }

  /// Of the time since `before_`.
  void note_disturbances() {
    const machine::ProcessorTimes after = machine::processor_times(plan_.cpus);
    results::ProcessUsage& usage = result_.repetition.usage;
    // Some counters go back a little at times.
    const auto since = [](Duration before, Duration now) { return std::max(Duration{}, now - before); };
    usage.stolen = since(before_.stolen, after.stolen);
    usage.throttled = since(before_.throttled, after.throttled);
    const Duration others = since(before_.busy + usage.cpu_time, after.busy);
    if (after.cpus > 0) usage.others = others / static_cast<std::int64_t>(after.cpus);
  }

  void note_shared_memory() {
    if (plan_.fastdds.network != FastDdsOptions::Network::shared_memory) return;
    for (const ForkedProcess& c : children_) {
      if (c.id > 0) shared_memory_.note(c.id);
    }
  }

  void tell_all(Kind kind, const ChannelMessage::Numbers& numbers = {}) {
    for (const ForkedProcess& c : children_) c.channel.send({kind, numbers});
  }

  /// Waits for `kind` from every process. False: a failure, or an interruption before the run
  /// began.
  bool await_all(Kind kind, Time limit) {
    for (std::uint32_t p = 0; p < children_.size(); ++p) {
      for (;;) {
        if (!watch_interrupt()) return false;
        if (began_) {
          progress_(std::clamp(now() - epoch_, Duration::zero(), plan_.length));
        } else {
          note_shared_memory();  // so that the files of a process that dies later are known
        }
        const auto message =
            children_[p].channel.receive(std::min(now() + std::chrono::milliseconds(100), limit));
        if (message && message->kind == Kind::closed) return fail(death(p));
        if (message && message->kind == Kind::failed) {
          result_.setup_failed = true;
          return fail(message->text.data());
        }
        if (message && message->kind == kind) {
          note(*message);
          break;
        }
        if (now() >= limit) return fail(name(p) + " did not answer in time and was killed; see --time-out");
      }
    }
    return true;
  }

  bool watch_interrupt() {
    if (program::interrupted() == 0 || result_.interrupted) return true;
    result_.interrupted = true;
    if (!began_) return false;
    tell_all(Kind::stop);
    return true;
  }

  void note(const ChannelMessage& message) {
    results::ProcessUsage& usage = result_.repetition.usage;
    switch (message.kind) {
      case Kind::begun:
        result_.policies.emplace_back(message.text.data());
        result_.timers_are_ordinary |= message.number[0] != 0;
        break;
      case Kind::stopped:
        stopped_ = std::max(stopped_, from_ns(message.number[0]));
        break;
      case Kind::done:
        usage.cpu_time += Duration(message.number[ChannelMessage::cpu_time_ns]);
        usage.peak_memory_kib += message.number[ChannelMessage::peak_memory_kib];
        usage.voluntary_switches += message.number[ChannelMessage::voluntary_switches];
        usage.involuntary_switches += message.number[ChannelMessage::involuntary_switches];
        break;
      default:
        break;
    }
  }

  std::string name(std::uint32_t p) const {
    std::vector<std::string> executors;
    if (!plan_.executor.entry && plan_.processes > 1) {
      for (const std::size_t e : parts_in(plan_, p))
        executors.push_back(setup::parts(plan_.executor)[e].place.name);
    }
    return program::concat("process ", p + 1, " of ", plan_.processes,
                           executors.empty() ? "" : " with " + program::joined(executors), " (executor ",
                           plan_.executor.label, ", repetition ", plan_.repetition, ")");
  }

  std::string death(std::uint32_t p) {
    int status = 0;
    pid_t& id = children_[p].id;
    const bool ended = program::await_process(id, &status) == id;
    if (ended) id = -1;
    if (began_) end_ = std::min(end_, now());
    return name(p) + " " + (ended ? program::how_it_ended(status) : "closed its channel");
  }

  bool fail(const std::string& failure) {
    if (result_.failure.empty()) result_.failure = failure;
    return false;
  }

  void end_all() {
    const bool orderly = result_.failure.empty() && !(result_.interrupted && !began_);
    // A process that has sent `done` is only cleaning up and gets time for it.
    const Time limit = now() + (orderly ? set_up_limit(plan_) : Duration::zero());
    for (ForkedProcess& c : children_) {
      for (; c.id > 0 && now() < limit; usleep(500)) {
        if (program::await_process(c.id, nullptr, WNOHANG) != 0) c.id = -1;
      }
    }
    note_shared_memory();
    std::erase_if(children_, [](const ForkedProcess& c) { return c.id < 0; });
    for (const ForkedProcess& c : children_) kill(c.id, SIGKILL);
    for (const ForkedProcess& c : children_) program::await_process(c.id, nullptr);
    shared_memory_.remove_orphans();
  }

  void collect() {
    results::Repetition& r = result_.repetition;
    r.trace = began_ ? collected_trace(plan_, memories_, epoch_, end_) : empty_trace(plan_);
    r.usage.wall = r.trace.end - r.trace.epoch;
    r.expected = expected_jobs(plan_.tasks.set, r.trace);
    if (began_) warn();
  }

  void warn() {
    const Trace& trace = result_.repetition.trace;
    const auto add = [&](const auto&... words) {
      result_.warnings.push_back(
          program::concat(plan_.executor.label, ", repetition ", plan_.repetition, ": ", words...));
    };
    if (trace.lost_records > 0) add(trace.lost_records, " records did not fit into the trace buffers");
    std::uint64_t rejected = 0;
    for (const RunMemory& memory : memories_) rejected += memory.rejected();
    if (rejected > 0)
      add(rejected, " samples of other programs on the topics of this run were ignored; ",
          "give the run its own DDS domain (--domain)");
    // Under rclcpp a release is the start of the callback.
    const bool arrivals_known = plan_.executor.stack == setup::Stack::native;
    for (const results::SwappedArrivals& pair : arrivals_known ? results::swapped_arrivals(plan_.tasks, trace)
                                                               : std::vector<results::SwappedArrivals>()) {
      const TaskSet& set = plan_.tasks.set;
      add(pair.swapped, " of ", pair.messages, " messages reached ", set[pair.arrived_first].name, " before ",
          set[pair.stated_first].name, ", against the graph's order of delivery",
          plan_.processes > 1 ? "; between processes DDS guarantees none" : "");
    }
    if (!result_.failure.empty()) return;
    for (const TaskAccount& a : account(plan_.tasks.set, trace)) {
      if (a.balanced()) continue;
      const Task& task = plan_.tasks.set[a.task];
      add(task.name, " accounts for ", a.accounted(), " of ", a.expected,
          task.kind == TaskKind::timer ? " timestamps" : " samples");
    }
  }

  const Plan& plan_;
  const std::function<void(Duration)>& progress_;
  const std::vector<std::uint32_t> process_of_node_;
  std::deque<RunMemory> memories_;
  std::vector<ForkedProcess> children_;  // one that has ended has the id -1
  std::optional<Publisher> publisher_;
  machine::SharedMemoryWatch shared_memory_;
  bool began_ = false;
  machine::ProcessorTimes before_;  // at the beginning
  Time epoch_{}, end_{};
  Time stopped_{};  // the latest end of a process
  Result result_;
};

}  // namespace

RunMemory::Size memory_size(const Plan& plan, std::uint32_t process) {
  const GraphTasks& tasks = plan.tasks;
  const std::vector<double> rates = activation_rates(tasks);
  const std::vector<ChainIndex> chains = index_chains(*plan.graph, tasks);
  std::vector<double> jobs(setup::parts(plan.executor).size(), 0);  // by executor, per second
  double outputs = 0;
  const auto add = [&](TaskId id, double rate) {
    jobs[executor_of(plan.executor, id)] += rate;
    for (const ChainIndex& c : chains) outputs += c.ends_in(id) ? rate : 0;
  };
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].kind == TaskKind::timer) add(id, rates[id]);
    for (const TaskId fed : tasks.set[id].feeds) add(fed, rates[id]);
  }
  const auto records = [&](double rate) {  // a third more than the nominal rate
    return static_cast<std::uint64_t>(rate * (to_s(plan.length) + 1) * 4 / 3) + 1024;
  };
  return {tasks.set.size(), static_cast<std::uint32_t>(workers_of(plan, process).size()),
          records(std::ranges::max(jobs)), records(outputs),
          static_cast<std::uint32_t>(parts_in(plan, process).size())};
}

Duration set_up_limit(const Plan& plan) {
  std::size_t endpoints = 0;
  for (const Node& node : plan.graph->nodes) endpoints += node.inputs.size() + node.outputs.size();
  // Ten times the measured time: 1 us for each pair of endpoints, which Fast DDS matches against
  // each other, and 100 ms for each process.
  const Duration comparisons = std::chrono::microseconds(10 * endpoints * endpoints);
  const Duration processes = std::chrono::seconds(plan.processes - 1);
  return plan.time_out + (is_dds(plan.transport) ? comparisons + processes : Duration::zero());
}

std::vector<std::size_t> parts_in(const Plan& plan, std::uint32_t process) {
  if (plan.executor.entry) return {0};
  std::vector<std::size_t> own;
  for (std::size_t e = 0; e < setup::parts(plan.executor).size(); ++e)
    if (setup::parts(plan.executor)[e].place.process == process) own.push_back(e);
  return own;
}

std::vector<std::uint32_t> assign_processes(const Graph& graph, std::uint32_t processes) {
  std::vector<std::uint32_t> process(graph.nodes.size());
  for (std::size_t i = 0; i < process.size(); ++i) {
    process[i] = static_cast<std::uint32_t>(i * processes / process.size());
  }
  return process;
}

Result run_repetition(const Plan& plan, const std::function<void(Duration)>& progress) {
  return Coordinator(plan, progress).run();
}

}  // namespace hotpath::live
