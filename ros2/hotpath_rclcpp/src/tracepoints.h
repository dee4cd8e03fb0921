/* SPDX-License-Identifier: Apache-2.0 */
/* Events of the LTTng provider `hotpath`, in the form that LTTng's headers read several times. */
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER hotpath
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "tracepoints.h"

#if !defined(HOTPATH_RCLCPP_TRACEPOINTS_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define HOTPATH_RCLCPP_TRACEPOINTS_H

#include <lttng/tracepoint.h>
#include <stdint.h>

/* clang-format off */
LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_init,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, const char*, name_arg, const char*, policy_arg,
    const char*, timers_arg, const char*, rule_arg, const char*, ties_arg, uint32_t, threads_arg,
    const char*, graph_arg, const char*, priorities_arg, uint8_t, learn_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_string(name, name_arg)
    lttng_ust_field_string(policy, policy_arg)
    lttng_ust_field_string(timers, timers_arg)
    lttng_ust_field_string(rule, rule_arg)
    lttng_ust_field_string(ties, ties_arg)
    lttng_ust_field_integer(uint32_t, threads, threads_arg)
    lttng_ust_field_string(graph, graph_arg)
    lttng_ust_field_string(priorities, priorities_arg)
    lttng_ust_field_integer(uint8_t, learn, learn_arg)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_thread,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, uint32_t, worker_arg, const char*, role_arg,
    const char*, policy_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_integer(uint32_t, worker, worker_arg)
    lttng_ust_field_string(role, role_arg)
    lttng_ust_field_string(policy, policy_arg)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_callback,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, uint32_t, task_arg, const char*, kind_arg,
    const char*, id_arg, const char*, node_arg, const char*, topic_arg, const void*, handle_arg,
    int64_t, period_arg, int64_t, deadline_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_integer(uint32_t, task, task_arg)
    lttng_ust_field_string(kind, kind_arg)
    lttng_ust_field_string(id, id_arg)
    lttng_ust_field_string(node, node_arg)
    lttng_ust_field_string(topic, topic_arg)
    lttng_ust_field_integer_hex(const void*, handle, handle_arg)
    lttng_ust_field_integer(int64_t, period, period_arg)
    lttng_ust_field_integer(int64_t, deadline, deadline_arg)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_priority,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, uint32_t, task_arg, int64_t, level_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_integer(uint32_t, task, task_arg)
    lttng_ust_field_integer(int64_t, level, level_arg)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_job,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, uint32_t, task_arg, uint64_t, sequence_arg,
    int64_t, timestamp_arg, int64_t, release_arg, int64_t, deadline_arg, uint32_t, skipped_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_integer(uint32_t, task, task_arg)
    lttng_ust_field_integer(uint64_t, sequence, sequence_arg)
    lttng_ust_field_integer(int64_t, timestamp, timestamp_arg)
    lttng_ust_field_integer(int64_t, release, release_arg)
    lttng_ust_field_integer(int64_t, deadline, deadline_arg)
    lttng_ust_field_integer(uint32_t, skipped, skipped_arg)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(hotpath, executor_end,
  LTTNG_UST_TP_ARGS(const void*, executor_arg, uint32_t, task_arg),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor, executor_arg)
    lttng_ust_field_integer(uint32_t, task, task_arg)
  )
)
/* clang-format on */

#endif

#include <lttng/tracepoint-event.h>
