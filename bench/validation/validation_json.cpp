// SPDX-License-Identifier: Apache-2.0
#include "program/json_fields.hpp"
#include "results/summary.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

// nlohmann::json finds these by argument-dependent lookup, also for elements of containers.
static HOTPATH_JSON_FIELDS(ScheduleSide, jobs, lost_percent, start_lateness_ms, response_ms,
                           response_authors_ms);
static HOTPATH_JSON_FIELDS(ScheduleComparison::Difference, place, at_ms, measured, other);
static HOTPATH_JSON_FIELDS(ScheduleComparison, similarity, similarity_by_period, first_difference,
                           largest_loss_difference_percent, agrees, measured, other);
static HOTPATH_JSON_FIELDS(GoldenValidation, set, executor, costs_us, without_costs, with_costs);
static HOTPATH_JSON_FIELDS(TimersOnlyRanges, imu_lost_percent, response_authors_p50_ms,
                           response_authors_p99_ms);
static HOTPATH_JSON_FIELDS(TimersOnlyValidation, set, executor, measured, simulated, agrees);
static HOTPATH_JSON_FIELDS(LatencyQuantiles, n, p10, p50, p90, p99, max);
static HOTPATH_JSON_FIELDS(MedianComparison, differs_percent, agrees);
static HOTPATH_JSON_FIELDS(AutowareValidation, executor, measured_ms, simulated_ms, median);
static HOTPATH_JSON_FIELDS(RunAgainstGolden, set, phases_differ_ms, real_busy_percent, run_busy_percent,
                           comparison, phases_file);
static HOTPATH_JSON_FIELDS(RunLatencies, measured_ms, simulated_ms, real_ms, phases_differ_ms, median);
static HOTPATH_JSON_FIELDS(RunValidation, run, executor, repetition, costs_us, comparison, latencies, golden);
HOTPATH_JSON_FIELDS(Validation, golden, timers_only, autoware, runs);

}  // namespace hotpath::validation
