// SPDX-License-Identifier: Apache-2.0
#include "live/run_process.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <map>
#include <system_error>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

Duration cpu_time(const rusage& usage) {
  return std::chrono::seconds(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         std::chrono::microseconds(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

rusage own_usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

using Kind = ChannelMessage::Kind;

struct CoordinatorGone {};

const Channel* last_words = nullptr;

/// Fast DDS terminates its program when it cannot start a thread.
[[noreturn]] void give_up() {
  std::string cause = "no exception";
  try {
    if (const std::exception_ptr active = std::current_exception()) std::rethrow_exception(active);
  } catch (const std::exception& error) {
    cause = error.what();
  } catch (...) {
    cause = "unknown exception";
  }
  last_words->send({Kind::failed,
                    {},
                    "a process of the run gave up (" + cause +
                        "); the system may lack threads (ulimit -u), memory or open files for it"});
  for (;;) pause();  // the coordinator looks for files that we leave before it ends us
}

ExecutorOptions thread_options(const RepetitionPlan& plan, std::size_t part) {
  ExecutorOptions options = default_options(*parts(plan.executor)[part].entry);
  options.measure_cpu_time = plan.measure_cpu_time;
  if (plan.executor_policy) options.executor_threads = {*plan.executor_policy, true, {}};
  if (plan.executor.deployment) {
    const DeployedExecutor& where = plan.executor.deployment->plan.executors[part];
    options.executor_threads = {where.policy, where.policy != ThreadPolicy{}, where.processors};
    const bool raised = parts(plan.executor)[part].entry->traits.raises_timer_thread;
    options.timer_thread = options.executor_threads;
    if (raised) options.timer_thread.policy = raised_above(where.policy);
  }
  if (plan.timer_policy) options.timer_thread = {*plan.timer_policy, true, {}};
  return options;
}

LiveOptions live_options(const RepetitionPlan& plan, std::uint32_t process) {
  LiveOptions options{{}, {}, plan.transport, plan.fastdds, plan.calibration};
  std::vector<std::uint32_t> number(parts(plan.executor).size(), 0);  // in this process
  for (const std::size_t e : parts_in(plan, process)) {
    const ExecutorSpec& part = parts(plan.executor)[e];
    number[e] = static_cast<std::uint32_t>(options.executors.size());
    options.executors.push_back({part.entry, part.scheduler, thread_options(plan, e)});
  }
  if (plan.executor.deployment) {
    for (const std::uint32_t e : plan.executor.deployment->plan.executor_of) {
      options.executor_of.push_back(number[e]);
    }
  }
  return options;
}

std::string as_text(const std::vector<WorkerThread>& workers) {
  constexpr std::size_t kMostOneByOne = 8;
  std::vector<std::string> texts;
  std::map<std::string, int> counts;
  for (const WorkerThread& worker : workers) {
    texts.push_back(to_string(worker));
    ++counts[texts.back()];
  }
  if (texts.size() <= kMostOneByOne) return joined(texts);
  texts.clear();
  for (const auto& [worker, count] : counts) texts.push_back(concat(count, " x ", worker));
  return joined(texts);
}

/// The timer management thread runs under the ordinary policy.
bool timers_are_ordinary(const std::vector<WorkerThread>& workers) {
  return std::ranges::any_of(workers, [](const WorkerThread& w) {
    return w.role == WorkerRole::timer_management && w.policy == ThreadPolicy{};
  });
}

/// The part of the run's life cycle that talks to the coordinator.
class Process {
 public:
  Process(const RepetitionPlan& plan, const Channel& coordinator) : plan_(plan), coordinator_(coordinator) {}

  /// The next message until `limit`, if there is one.
  std::optional<ChannelMessage> receive(Time limit) const {
    const auto message = coordinator_.receive(limit);
    if (message && message->kind == Kind::closed) throw CoordinatorGone();
    return message;
  }

  ChannelMessage expect(Kind kind) const {
    for (;;) {
      const auto message = receive(now() + std::chrono::hours(1));
      if (message && message->kind == kind) return *message;
    }
  }

  void tell(const ChannelMessage& message) const {
    if (!coordinator_.send(message)) throw CoordinatorGone();
  }

  /// Until `end`, or, which returns false, until the coordinator asks for an earlier one.
  bool wait(Time end, LiveSystem& system) const {
    while (now() < end) {
      const auto message = receive(end);
      if (message && message->kind == Kind::stop) {
        system.stop();
        return false;
      }
    }
    return true;
  }

  void run(const GraphTasks& tasks, std::uint32_t process, std::deque<RunMemory>& memories) const {
    LiveSystem system(*plan_.graph, tasks, live_options(plan_, process), memories[process]);
    system.wait_until_matched(now() + plan_.time_out);
    tell(Kind::matched);

    const ChannelMessage begin = expect(Kind::begin);
    const Time epoch = from_ns(begin.number[0]), end = from_ns(begin.number[1]);
    system.start(epoch, end);
    tell({Kind::begun, {timers_are_ordinary(system.workers())}, as_text(system.workers())});
    const bool goes_on = wait(epoch, system);
    const rusage before = own_usage();
    if (goes_on) wait(end, system);
    const Time ended = system.join();
    const rusage after = own_usage();
    tell({Kind::stopped, {to_ns(ended)}});

    expect(Kind::settle);
    settle(tasks, memories, system);
    system.close();
    tell({Kind::done,
          {(cpu_time(after) - cpu_time(before)).count(), after.ru_maxrss, after.ru_nvcsw - before.ru_nvcsw,
           after.ru_nivcsw - before.ru_nivcsw, static_cast<std::int64_t>(system.refused())}});
  }

 private:
  /// Waits, for a bounded time, until all samples that were published for this process have arrived.
  static void settle(const GraphTasks& tasks, std::deque<RunMemory>& memories, const LiveSystem& system) {
    const Time limit = now() + std::chrono::seconds(2);
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (!tasks.set[id].local) continue;
      while (system.arrived(id) < published_for(memories, id) && now() < limit) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  }

  const RepetitionPlan& plan_;
  const Channel& coordinator_;
};

}  // namespace

int run_process(const RepetitionPlan& plan, std::uint32_t process,
                const std::vector<std::uint32_t>& process_of_node, std::deque<RunMemory>& memories,
                const Channel& coordinator) {
  // The coordinator answers for the terminal's signals. If it is killed, its channel closes and we end in
  // order, so that Fast DDS removes its files.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);

  last_words = &coordinator;
  std::set_terminate(give_up);

  const Process life(plan, coordinator);
  try {
    if (!plan.cpus.empty()) pin_to_cpus(plan.cpus);
    if (plan.lock_memory) lock_memory();
    GraphTasks tasks = plan.tasks;
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      tasks.set.tasks[id].local = process_of_node[tasks.origin[id].node] == process;
    }
    life.run(tasks, process, memories);
    return 0;
  } catch (const CoordinatorGone&) {
  } catch (const std::system_error& error) {
    coordinator.send({Kind::failed, {}, concat("a process of the run cannot be set up: ", error.what())});
  } catch (const std::exception& error) {
    coordinator.send({Kind::failed, {}, error.what()});
  }
  return 1;
}

}  // namespace hotpath
