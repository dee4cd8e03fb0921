// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "model.hpp"

namespace independent {

enum class Family { wait_set, events, groups, fixed_priority, deadline };

/// An error in the simulator, which a comparison with hotpath must find.
enum class Fault {
  none,
  equal_priority_fifo,      // among subscriptions of one priority the oldest first
  timers_before_samples,    // at equal priority
  exact_timestamp_kept,     // humble's rcl: a timestamp equal to now is not skipped
  newest_overwritten,       // a full history drops the arriving sample
  join_keeps_slots,         // an output does not empty the slots
  join_of_any,              // one new input completes a set
  incomplete_set_works,     // a job that completes no set takes its time
  every_from_first,         // the first message comes from job 1
  last_of_repeats,          // a message repeats samples of earlier messages
  polls_after_each_job,     // the wait set has no snapshot
  kinds_swapped,            // default: subscriptions first; static: timers first
  own_deadline,             // a sample's deadline counts from its publication
  least_urgent_inherited,   // the longest period upstream instead of the shortest
  earliest_source_start,    // in the hot-path latency
  newest_source_timestamp,  // in the end-to-end latency
  groups_ignored,           // cbg as one queue
  stale_events_withdrawn,   // an overwritten sample takes its event along
  delivery_reversed,        // to the subscriptions of a topic
  dispatch_of_work_only,    // an event without a sample costs no dispatch
  thread_priority_ignored,  // of several threads, that awake for longest runs
  not_preempted,            // a thread that runs a job keeps the processor
  one_processor,            // all threads share the first processor
  services_wait,            // a service that has waited does not run next
  waitables_asked_early,    // for samples within a process when the wait ends
  count                     // not a fault
};

/// An executor with one thread, as docs name it: `default`, `static`, `static-jazzy`, `events-ro`, `cbg:1`,
/// and `rm-ro`, `dm-ro`, `edf-ro`, `fp-ro` with `:first` and `:fifo`.
struct Executor {
  explicit Executor(const std::string& label);

  std::string label;
  std::string policy;  ///< rm, dm, edf, fp, or empty.
  Family family = Family::events;
  bool timers_first = true;  ///< Of wait sets.
  bool waits_after_each_job = false;
  bool samples_first = false;  ///< `:first`.
  bool fifo = false;           ///< `:fifo`.
  bool at_dispatch = false;    ///< A reentrant group waits again when its job begins.
};

enum class Outcome { ran, running, skipped, overwritten, empty };

struct Job {
  int task = 0;
  std::int64_t sequence = 0;
  Outcome outcome = Outcome::ran;
  Nanoseconds timestamp = 0, release = 0, start = 0, finish = 0, deadline = 0;
  int parent = -1;
  std::int64_t parent_sequence = 0;
};

struct Output {
  int chain = 0;
  std::int64_t sequence = 0;
  Nanoseconds hot_path = 0, end_to_end = 0;
  bool duplicates = false;  ///< The data contains several jobs of one source.
};

struct Result {
  std::vector<Job> jobs;  ///< In the order in which they started or fell out.
  std::vector<Output> outputs;
};

/// The time from a publication to its arrival at a subscription, drawn anew for each sample.
using Delay = std::function<Nanoseconds()>;

/// The execution time of a job.
using Draw = std::function<Nanoseconds(int task, std::int64_t sequence)>;

struct Conditions {
  std::vector<Nanoseconds> phases;  ///< By task; subscriptions have none.
  Nanoseconds until = 0;
  /// Costs from each decision to the start of the job of a timer, and of a subscription.
  Nanoseconds timer_dispatch = 0, dispatch = 0;
  Delay delay{};  ///< Empty: samples arrive at once.
  /// At one instant, samples of several publishers or for several subscriptions arrive in an order of their
  /// own, before or after the executor decides.
  bool any_order = false;
};

/// An executor whose thread runs under SCHED_FIFO on one processor (docs/deployments.md). Its timer thread,
/// if it has one, releases timers at once.
struct Thread {
  Executor executor;
  int priority = 1;  ///< The largest goes first.
  std::size_t processor = 0;
};
struct Deployment {
  std::vector<Thread> threads;
  std::vector<std::size_t> thread_of;  ///< By task.
  Fault fault = Fault::none;
};

/// The schedule of the graph until an instant. No decision is made at or after it. A thread is preempted by
/// any of a larger priority, keeps its place among those of its own until it sleeps, and decides when it has
/// the processor.
Result simulate(const Graph& graph, const Deployment& deployment, const Conditions& conditions,
                const Draw& draw);

}  // namespace independent
