// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/summary.hpp"

namespace hotpath {

/// What run.json keeps of the tasks, so that a run can be read without its graph: an array of
/// {task, kind, wcet_ns, period_ns, deadline_ns}, the latter two for timers. The second throws nlohmann's
/// exceptions, or std::out_of_range, for what is none.
[[nodiscard]] nlohmann::json tasks_json(const TaskSet& set);
[[nodiscard]] TaskSet tasks_from_json(const nlohmann::json& tasks);

/// What `runs` of run.json keeps of one repetition besides its rows in the CSV files: executor, repetition,
/// first timestamps (milliseconds by timer), usage, records lost, and what the loss equations expect of each
/// task and chain. `set` has the phases of the repetition.
[[nodiscard]] nlohmann::json repetition_json(const TaskSet& set, const std::vector<std::string>& chains,
                                             const Repetition& repetition);

/// Whether the durations of jobs tell how fast a processor was, by run.json: those of a live run do whose
/// nodes do a fixed amount of work. Throws nlohmann's exceptions.
[[nodiscard]] inline bool tells_processor_speed(const nlohmann::json& run) {
  return run.value("kind", "") == "live" && run.value("work", "") == "fixed";
}

}  // namespace hotpath
