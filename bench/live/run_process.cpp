// SPDX-License-Identifier: Apache-2.0
#include "live/run_process.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <system_error>
#include <thread>

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

Duration duration_of(const timeval& t) {
  return std::chrono::seconds(t.tv_sec) + std::chrono::microseconds(t.tv_usec);
}

rusage own_usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

struct CoordinatorGone {};

void tell_failure(const Channel& coordinator, const std::string& what) {
  coordinator.send(ChannelMessage(ChannelMessage::Kind::failed, {}, what));
}

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
  tell_failure(*last_words, "a process of the run gave up (" + cause +
                                "); the system may lack threads (ulimit -u), memory or open files for it");
  for (;;) pause();  // the coordinator looks for files that we leave before it ends us
}

ExecutorOptions thread_options(const RepetitionPlan& plan) {
  ExecutorOptions options = default_options(*plan.executor.entry);
  options.measure_cpu_time = plan.measure_cpu_time;
  if (plan.executor_policy) options.executor_threads = {*plan.executor_policy, true};
  if (plan.timer_policy) options.timer_thread = {*plan.timer_policy, true};
  return options;
}

std::string as_text(const std::vector<WorkerThread>& workers) {
  std::string text;
  for (const WorkerThread& worker : workers) text += (text.empty() ? "" : ", ") + to_string(worker);
  return text;
}

/// The timer management thread runs under the ordinary policy.
bool timers_are_ordinary(const std::vector<WorkerThread>& workers) {
  return std::any_of(workers.begin(), workers.end(), [](const WorkerThread& w) {
    return w.role == WorkerRole::timer_management && w.policy == ThreadPolicy{};
  });
}

/// The part of the run's life cycle that talks to the coordinator.
class Process {
 public:
  Process(const RepetitionPlan& plan, const Channel& coordinator) : plan_(plan), coordinator_(coordinator) {}

  ChannelMessage expect(ChannelMessage::Kind kind) const {
    for (;;) {
      bool closed = false;
      const auto message = coordinator_.receive(now() + std::chrono::hours(1), closed);
      if (closed) throw CoordinatorGone();
      if (message && message->kind == kind) return *message;
    }
  }

  void tell(ChannelMessage::Kind kind, const ChannelMessage::Numbers& numbers = {},
            const std::string& text = "") const {
    if (!coordinator_.send(ChannelMessage(kind, numbers, text))) throw CoordinatorGone();
  }

  /// Until `end`, or, which returns false, until the coordinator asks for an earlier one.
  bool wait(Time end, Executor& executor) const {
    while (now() < end) {
      bool closed = false;
      const auto message = coordinator_.receive(end, closed);
      if (closed) throw CoordinatorGone();
      if (message && message->kind == ChannelMessage::Kind::stop) {
        executor.stop();
        return false;
      }
    }
    return true;
  }

  void run(const GraphTasks& tasks, std::deque<RunMemory>& memories, RunMemory& own) const {
    LiveOptions options;
    options.executor = plan_.executor.entry;
    options.scheduler = plan_.executor.scheduler;
    options.threads = thread_options(plan_);
    options.transport = plan_.transport;
    options.fastdds = plan_.fastdds;
    options.calibration = plan_.calibration;
    LiveSystem system(*plan_.graph, tasks, options, own);
    system.wait_until_matched(now() + plan_.time_out);
    tell(ChannelMessage::Kind::matched);

    const ChannelMessage begin = expect(ChannelMessage::Kind::begin);
    const Time epoch = from_ns(begin.number[0]), end = from_ns(begin.number[1]);
    Executor& executor = system.executor();
    executor.start(epoch, end);
    tell(ChannelMessage::Kind::begun, {timers_are_ordinary(executor.workers())}, as_text(executor.workers()));
    const bool goes_on = wait(epoch, executor);
    const rusage before = own_usage();
    if (goes_on) wait(end, executor);
    const Time ended = executor.join();
    const rusage after = own_usage();
    tell(ChannelMessage::Kind::stopped, {to_ns(ended)});

    expect(ChannelMessage::Kind::settle);
    settle(tasks, memories, executor);
    executor.close();
    tell(ChannelMessage::Kind::done,
         {(duration_of(after.ru_utime) + duration_of(after.ru_stime) - duration_of(before.ru_utime) -
           duration_of(before.ru_stime))
              .count(),
          after.ru_maxrss, after.ru_nvcsw - before.ru_nvcsw, after.ru_nivcsw - before.ru_nivcsw});
  }

 private:
  /// Waits, for a bounded time, until all samples that were published for this process have arrived.
  static void settle(const GraphTasks& tasks, std::deque<RunMemory>& memories, const Executor& executor) {
    const Time limit = now() + std::chrono::seconds(2);
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (!tasks.set[id].local) continue;
      while (executor.arrived(id) < published_for(memories, id) && now() < limit) {
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
    life.run(tasks, memories, memories[process]);
    return 0;
  } catch (const CoordinatorGone&) {
  } catch (const std::system_error& error) {
    tell_failure(coordinator, "a process of the run cannot be set up: " + std::string(error.what()));
  } catch (const std::exception& error) {
    tell_failure(coordinator, error.what());
  }
  return 1;
}

}  // namespace hotpath
