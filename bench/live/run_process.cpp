// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <system_error>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "live/repetition_runner.hpp"
#include "program/text.hpp"

namespace hotpath::live {

namespace {

using Kind = ChannelMessage::Kind;

const Channel* last_words = nullptr;

/// Terminate handler: Fast DDS terminates its program when it cannot start a thread.
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
  for (;;) pause();  // the coordinator notes the shared memory of this process, then kills it
}

ExecutorOptions thread_options(const Plan& plan, const setup::ExecutorSpec& part) {
  const ThreadPolicy& policy = part.place.policy;
  const ThreadPolicyRequest threads{policy, policy != ThreadPolicy{}, part.place.processors};
  ExecutorOptions options{threads, threads, plan.cpu_time};
  if (part.entry->traits.raises_timer_thread) options.timer_thread.policy = raised_above(policy);
  if (plan.executor_policy) options.executor_threads = {*plan.executor_policy, true, {}};
  if (plan.timer_policy) options.timer_thread = {*plan.timer_policy, true, {}};
  return options;
}

LiveOptions live_options(const Plan& plan, std::uint32_t process) {
  LiveOptions options{{}, {}, plan.transport, plan.fastdds, plan.calibration.value_or(Calibration{})};
  std::vector<std::uint32_t> number(setup::parts(plan.executor).size(), 0);  // in this process
  for (const std::size_t e : parts_in(plan, process)) {
    const setup::ExecutorSpec& part = setup::parts(plan.executor)[e];
    number[e] = static_cast<std::uint32_t>(options.executors.size());
    options.executors.push_back({part.entry, part.scheduler, thread_options(plan, part)});
  }
  for (const std::uint32_t e : plan.executor.plan.executor_of) options.executor_of.push_back(number[e]);
  return options;
}

/// Waits until all samples published for this process have arrived, for a bounded time.
void settle(const GraphTasks& tasks, std::deque<RunMemory>& memories, const LiveSystem& system) {
  const Time limit = now() + std::chrono::seconds(2);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.set[id].local) continue;
    while (system.arrived(id) < published_for(memories, id) && now() < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

}  // namespace

int run_process(const Plan& plan, std::uint32_t process, const std::vector<std::uint32_t>& process_of_node,
                std::deque<RunMemory>& memories, const Channel& coordinator) {
  // The coordinator handles the terminal's signals. If it is killed, its channel closes and this
  // process ends in order, so that Fast DDS removes its files.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);

  last_words = &coordinator;
  std::set_terminate(give_up);

  try {
    if (!plan.cpus.empty()) pin_to_cpus(plan.cpus);
    if (plan.lock_memory) lock_memory();
    GraphTasks tasks = plan.tasks;
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      tasks.set.tasks[id].local = process_of_node[tasks.origin[id].node] == process;
    }
    LiveSystem system(*plan.graph, tasks, live_options(plan, process), memories[process]);
    RunLife(coordinator).live_through(system, now() + set_up_limit(plan), [&] {
      settle(tasks, memories, system);
    });
    return 0;
  } catch (const CoordinatorGone&) {
  } catch (const std::system_error& error) {
    coordinator.send(
        {Kind::failed, {}, program::concat("a process of the run cannot be set up: ", error.what())});
  } catch (const std::exception& error) {
    coordinator.send({Kind::failed, {}, error.what()});
  }
  return 1;
}

}  // namespace hotpath::live
