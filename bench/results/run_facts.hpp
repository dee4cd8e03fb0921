// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// The tasks in run.json, which make a run readable without its graph: an array of {task, kind,
/// wcet_ns, period_ns, deadline_ns}, the latter two for timers. tasks_from_json() throws nlohmann's
/// exceptions or std::out_of_range for invalid input.
[[nodiscard]] nlohmann::json tasks_json(const TaskSet& set);
[[nodiscard]] TaskSet tasks_from_json(const nlohmann::json& tasks);

/// An entry of `runs` in run.json, the facts of a repetition besides its rows in the CSV files:
/// executor, repetition, first timestamps (milliseconds by timer), usage, lost records, and the
/// counts that the loss equations expect for each task and chain. `set` has the phases of the
/// repetition.
[[nodiscard]] nlohmann::json repetition_json(const TaskSet& set, const std::vector<std::string>& chains,
                                             const Repetition& repetition);

/// Whether job durations reveal the CPU's speed, according to run.json: only in live runs with a
/// fixed amount of work. Throws nlohmann's exceptions.
[[nodiscard]] inline bool tells_processor_speed(const nlohmann::json& run) {
  return run.value("kind", "") == "live" && run.value("work", "") == "fixed";
}

}  // namespace hotpath
