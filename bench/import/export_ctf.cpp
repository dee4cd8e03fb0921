// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "hotpath/tracing/ctf_writer.hpp"
#include "import/hypothesis.hpp"
#include "import/import_ctf.hpp"
#include "import/run_events.hpp"
#include "program/errors.hpp"
#include "program/forked_task.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::imports {

namespace {

namespace fs = std::filesystem;
/// An executor that rclcpp has from Jazzy on.
bool is_jazzy(const setup::ExecutorSpec& executor) {
  const auto& on_rclcpp = executor.entry->traits.on_rclcpp;
  return on_rclcpp && on_rclcpp->first >= RosDistro::jazzy;
}

/// Sets what rclcpp's events say of each thread. A deployment numbers its threads executor by
/// executor; in a simulation only the deployment knows their processes.
void set_threads(const setup::ExecutorSpec& executor, bool simulated, ExportedRun& exported) {
  exported.jazzy = std::ranges::any_of(setup::parts(executor), is_jazzy);
  if (!executor.deployment) return exported.polled.assign(kMaxWorkers, emits_waits(executor.entry->traits));
  std::vector<std::uint16_t> processes;
  for (std::size_t e = 0; e < setup::parts(executor).size(); ++e) {
    const setup::ExecutorSpec& part = setup::parts(executor)[e];
    const std::uint32_t workers = worker_count(*part.entry, part.scheduler);
    exported.polled.insert(exported.polled.end(), workers, emits_waits(part.entry->traits));
    const DeployedExecutor& deployed = executor.deployment->plan.executors[e];
    processes.insert(processes.end(), workers, static_cast<std::uint16_t>(deployed.process));
    exported.processors.insert(exported.processors.end(), workers, deployed.processors);
  }
  for (JobRecord& r : exported.trace.jobs) {
    if (simulated && r.worker < processes.size()) r.process = processes[r.worker];
  }
}

/// In a process of its own: babeltrace 2.0 frees memory twice when the disk is full.
void write_ctf(const fs::path& folder, const ExportedRun& exported) {
  program::ForkedTask writer([&] {
    if (std::freopen("/dev/null", "w", stderr) == nullptr) return;
    tracing::write_ctf(folder, events_of(exported, true).events, "hotpath");
  });
  std::string why = writer.wait();
  if (why.empty()) return;
  std::error_code error;
  constexpr std::uintmax_t kFull = 1 << 16;  // bytes
  if (fs::space(folder.parent_path(), error).available < kFull && !error) why = "the disk is full";
  throw program::RunError(program::concat(folder.string(), " cannot be written (", why, ")"));
}

}  // namespace

void export_ctf(const std::string& folder, const std::string& output) {
  program::check_output_folder(output);
  results::StoredRun run(folder, "RUN");
  const setup::StoredSystem system = setup::stored_system(run);
  run.load(system.tasks.set);
  for (const Trace& trace : run.traces()) {
    const GraphTasks tasks = system.tasks_of(run, trace.executor, trace.repetition);
    ExportedRun exported{system.graph, tasks, trace, {}, {}, {}, false, run.record().cores()};
    run.check([&] { set_threads(system.executor(trace.executor), system.simulated, exported); });
    const bool one = run.traces().size() == 1;
    const fs::path to =
        one ? fs::path(output) : fs::path(output) / program::concat(trace.executor, "-", trace.repetition);
    if (to.has_parent_path()) program::create_folder(to.parent_path());
    program::write_whole_folder(to, [&](const fs::path& part) { write_ctf(part, exported); });
  }
}

}  // namespace hotpath::imports
