// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hotpath/tracing/ctf_writer.hpp"
#include "import/import_ctf.hpp"
#include "import/run_events.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// Only rclcpp's executors that share the class Executor emit events of their waits.
bool has_wait_events(const ExecutorSpec& executor) {
  const ExecutorTraits& traits = executor.entry->traits;
  return traits.family == Family::wait_set && traits.runs_first == TaskKind::timer;
}

/// An executor that rclcpp has from Jazzy on.
bool is_jazzy(const ExecutorSpec& executor) {
  const auto& on_rclcpp = executor.entry->traits.on_rclcpp;
  return on_rclcpp && on_rclcpp->first >= RosDistro::jazzy;
}

/// Sets what rclcpp's events say of each thread. A deployment numbers its threads executor by
/// executor; in a simulation only the deployment knows their processes.
void set_threads(const ExecutorSpec& executor, bool simulated, ExportedRun& exported) {
  exported.jazzy = std::ranges::any_of(parts(executor), is_jazzy);
  if (!executor.deployment) return exported.polled.assign(kMaxWorkers, has_wait_events(executor));
  std::vector<std::uint16_t> processes;
  for (std::size_t e = 0; e < parts(executor).size(); ++e) {
    const ExecutorSpec& part = parts(executor)[e];
    const std::uint32_t workers = worker_count(*part.entry, part.scheduler);
    exported.polled.insert(exported.polled.end(), workers, has_wait_events(part));
    const auto process = static_cast<std::uint16_t>(executor.deployment->plan.executors[e].process);
    processes.insert(processes.end(), workers, process);
  }
  for (JobRecord& r : exported.trace.jobs) {
    if (simulated && r.worker < processes.size()) r.process = processes[r.worker];
  }
}

}  // namespace

void export_ctf(const std::string& folder, const std::string& output) {
  check_output_folder(output);
  StoredRun run(folder, "RUN");
  const StoredSystem system = stored_system(run);
  run.load(system.tasks.set);
  for (const Trace& trace : run.traces()) {
    const GraphTasks tasks = system.tasks_of(run, trace.executor, trace.repetition);
    ExportedRun exported{system.graph, tasks, trace, {}, false, run.record().cores()};
    run.check([&] { set_threads(system.executor(trace.executor), system.simulated, exported); });
    const bool one = run.traces().size() == 1;
    const fs::path to =
        one ? fs::path(output) : fs::path(output) / concat(trace.executor, "-", trace.repetition);
    if (to.has_parent_path()) create_folder(to.parent_path());
    write_whole_folder(
        to, [&](const fs::path& part) { tracing::write_ctf(part, run_events(exported).events, "hotpath"); });
  }
}

}  // namespace hotpath
