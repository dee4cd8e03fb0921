// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/executor_label.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"
#include "simulated/own_times.hpp"
#include "simulated/repetition.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// For a live run, the platform has its number of processors and the costs seen in its gaps.
Graph graph_of(const Trace& trace, const results::StoredRun& run, Graph graph) {
  if (run.record().simulation) return graph;
  graph.platform.cores = run.record().cores();
  const simulated::OwnCosts costs = simulated::own_costs(trace, graph.platform.cores);
  graph.platform.set_dispatch_costs(costs.dispatch);
  graph.platform.wake_up_latency = costs.wake_up;
  return graph;
}

Trace simulate_again(const Trace& trace, const results::StoredRun& run, const setup::StoredSystem& system,
                     const Graph& graph, const GraphTasks& tasks) {
  const auto times = simulated::times_again(run, system, tasks, trace.executor, trace.repetition);
  simulated::Plan plan{system.executor(trace.executor), graph, tasks, *times};
  plan.warm_up = run.warm_up();
  plan.duration = run.length() - run.warm_up();
  // For a live run an overload is a valid result.
  plan.max_backlog = system.simulated ? system.backlog : SimulationOptions{}.max_backlog;
  try {
    return simulated::simulate_repetition(plan).trace;
  } catch (const SimulationError& error) {
    throw program::RunError(program::concat(run.folder().string(), ": ", trace.executor, ": ", error.what()));
  }
}

/// The real stack's latencies, for unchanged Autoware at the same load, and the largest difference of phases.
json real(const setup::StoredSystem& system, const std::string& label, const TaskSet& set,
          const fs::path& reference) {
  // The reference's crunch of 4.22 ms at 190 crunches a second, and the difference that counts as none.
  constexpr double kReferenceLoad_percent = 80.2, kSameLoad_percent = 2;
  const Graph& graph = system.graph;
  json row = {{"real_ms", nullptr}, {"phases_differ_ms", nullptr}};
  if (graph.name != "autoware" || system.options.copies > 1 || system.options.rate_percent ||
      std::abs(load_percent(graph) - kReferenceLoad_percent) > kSameLoad_percent) {
    return row;
  }
  const bool first = system.executor(label).scheduler.rule == SubscriptionRule::first;
  // The reference writes `rm-ro (first)` for `rm-ro:first`.
  const std::string wanted = results::ExecutorLabel(label).name + (first ? " (first)" : "");
  const fs::path file = reference / "rclcpp_autoware_phases.csv";
  CsvReader rows(file);
  while (rows.next() && row["real_ms"].is_null()) {
    if (rows.text("executor") != wanted) continue;
    row = {{"real_ms", real_latencies(rows)},
           {"phases_differ_ms", largest_phase_difference_ms(set, read_phases(file, graph, wanted))}};
  }
  return row;
}

/// The row of a repetition.
json row_of(const Trace& trace, const results::StoredRun& run, const setup::StoredSystem& system,
            const fs::path& reference) {
  const GraphTasks tasks = system.tasks_of(run, trace.executor, trace.repetition);
  const ExecutorEntry* const executor = run.check([&] { return system.executor(trace.executor).entry; });
  const Graph graph = graph_of(trace, run, system.graph);
  const Trace simulated = simulate_again(trace, run, system, graph, tasks);
  const results::Schedule schedule = results::schedule_of(tasks.set, trace);
  const results::ProcessUsage& usage = run.run(trace.executor, trace.repetition).usage;
  const std::vector<std::string> disturbed =
      run.record().live ? results::disturbances(usage) : std::vector<std::string>();
  json row = {{"run", run.folder().string()},
              {"executor", trace.executor},
              {"repetition", trace.repetition},
              {"costs_us",
               {{"dispatch", to_us(graph.platform.timer_dispatch_cost)},
                {"wake_up", to_us(graph.platform.wake_up_latency)}}},
              {"comparison", compare_schedules(schedule, results::schedule_of(tasks.set, simulated))},
              {"disturbed", disturbed},
              {"latencies", nullptr},
              {"golden", nullptr}};
  const auto first_chain_ms = [](const Trace& of) {
    return results::latencies_ms(of.chains, 0, Latency::hot_path);
  };
  if (const std::vector<double> measured = first_chain_ms(trace); !measured.empty()) {
    row["latencies"] = real(system, trace.executor, tasks.set, reference);
    row["latencies"].update(compare_latencies(quantiles(measured), first_chain_ms(simulated), 0.05));
  } else if (executor != nullptr) {
    row["golden"] = against_golden(reference, graph.name, schedule, *executor);
  }
  return row;
}

/// Every executor and repetition of a stored run, live or simulated, compared with a simulation of its
/// phases, measured execution times and costs, and with the real stack on the same graph, where the reference
/// has it.
json run_rows(const fs::path& folder, const fs::path& reference) {
  results::StoredRun run(folder, "RUN");
  const setup::StoredSystem system = setup::stored_system(run);
  run.load(system.tasks.set);
  json rows = json::array();
  for (const Trace& trace : run.traces()) rows.push_back(row_of(trace, run, system, reference));
  return rows;
}

fs::path find_reference(const std::string& folder) {
  if (!folder.empty()) return folder;
  if (const auto installed = find_ros2_reference()) return *installed;
  throw program::UsageError("the reference measurements are not installed; give their folder");
}

/// Stores, prints and draws the rows that `add` gets from the reference.
void validate(const std::string& output, const char* name, const std::string& reference_folder,
              const auto& add) {
  const fs::path folder = setup::output_folder(output, name);
  program::check_output_folder(folder);
  const fs::path reference = find_reference(reference_folder);
  json content = {{"kind", "validation"},         {"version", HOTPATH_VERSION}, {"golden", json::array()},
                  {"timers_only", json::array()}, {"autoware", json::array()},  {"runs", json::array()}};
  add(content, reference);
  program::create_folder(folder);
  program::write_whole_file(folder / "validation.json", "--output", content);
  program::show_json(content);
  program::become_python_tool("validate", {folder.string()});
}

}  // namespace

void validate_runs(const std::vector<std::string>& runs, const std::string& output) {
  validate(output, "diff", "", [&](json& content, const fs::path& reference) {
    for (const std::string& run : runs)
      for (json& row : run_rows(run, reference)) content["runs"].push_back(std::move(row));
  });
}

void validate_simulator(const std::string& reference_folder, const std::string& output) {
  validate(output, "golden", reference_folder, [](json& content, const fs::path& reference) {
    content["golden"] = golden_rows(reference);
    content["timers_only"] = timers_only_rows(reference);
    content["autoware"] = autoware_rows(reference);
  });
}

}  // namespace hotpath::validation
