// SPDX-License-Identifier: Apache-2.0
#include "trace_events.hpp"

#include "hotpath/live/sensor_call.hpp"

#ifdef HOTPATH_WITH_LTTNG
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "tracepoints.h"
#endif

namespace hotpath::trace {

namespace {

/// Also to the sensor of `hotpath watch`, if the program runs with it.
void tell_sensor(const void* executor, const Setup& setup) {
  if (auto* const call = sensor_call<void(const void*, const char*)>("hotpath_watch_executor"))
    call(executor, setup.name.c_str());
}

void tell_sensor(const void* executor, const Job& job) {
  using Call = void(const void*, std::uint64_t, std::int64_t, std::int64_t);
  static auto* const call = sensor_call<Call>("hotpath_watch_job");
  if (call != nullptr) call(executor, job.task, to_ns(job.timestamp), to_ns(job.release));
}

}  // namespace

#ifdef HOTPATH_WITH_LTTNG

void executor_init(const void* executor, const Setup& setup) {
  tell_sensor(executor, setup);
  const ExecutorTraits& traits = setup.executor->traits;
  lttng_ust_tracepoint(hotpath, executor_init, executor, setup.name.c_str(), to_string(traits.queue_order()),
                       to_string(traits.timers), to_string(setup.scheduler.rule),
                       to_string(setup.scheduler.ties), setup.scheduler.release_only_workers,
                       setup.graph.name.c_str(), setup.priorities_file.c_str(), setup.learn ? 1 : 0);
}

void executor_thread(const void* executor, Worker worker, WorkerRole role, const ThreadPolicy& policy) {
  lttng_ust_tracepoint(hotpath, executor_thread, executor, worker, to_string(role),
                       to_string(policy).c_str());
}

void executor_callback(const void* executor, const Entry& entry) {
  if (!lttng_ust_tracepoint_enabled(hotpath, executor_callback)) return;
  const char* const kind = entry.is_timer()      ? to_string(TaskKind::timer)
                           : entry.is_waitable() ? to_string(EntityKind::waitable)
                                                 : to_string(entry.task.entity);
  lttng_ust_do_tracepoint(hotpath, executor_callback, executor, entry.number, kind, entry.id.c_str(),
                          entry.node.c_str(), entry.topic.c_str(), entry.handle, entry.task.period.count(),
                          entry.task.deadline.count());
}

bool priorities_are_recorded() { return lttng_ust_tracepoint_enabled(hotpath, executor_priority); }

void executor_priority(const void* executor, TaskId task, std::int64_t level) {
  lttng_ust_tracepoint(hotpath, executor_priority, executor, task, level);
}

void executor_job(const void* executor, const Job& job) {
  tell_sensor(executor, job);
  lttng_ust_tracepoint(hotpath, executor_job, executor, job.task, job.sequence, to_ns(job.timestamp),
                       to_ns(job.release), to_ns(job.deadline), job.skipped);
}

void executor_end(const void* executor, const Entry& entry, TaskId task) {
  if (entry.task.entity == EntityKind::client || entry.task.entity == EntityKind::waitable)
    lttng_ust_tracepoint(hotpath, executor_end, executor, task);
}

#else

void executor_init(const void* executor, const Setup& setup) { tell_sensor(executor, setup); }
void executor_thread(const void*, Worker, WorkerRole, const ThreadPolicy&) {}
void executor_callback(const void*, const Entry&) {}
bool priorities_are_recorded() { return false; }
void executor_priority(const void*, TaskId, std::int64_t) {}
void executor_job(const void* executor, const Job& job) { tell_sensor(executor, job); }
void executor_end(const void*, const Entry&, TaskId) {}

#endif

}  // namespace hotpath::trace
