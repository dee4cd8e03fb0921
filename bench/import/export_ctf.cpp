// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

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
using nlohmann::json;

const ExecutorEntry* registered(const std::string& label) {
  return find_executor(label.substr(0, label.find_first_of(":@")));
}

/// Of the executors of rclcpp only those that share the class Executor have events of their waits.
bool has_wait_events(const std::string& label) {
  const ExecutorEntry* const entry = registered(label);
  return entry != nullptr && entry->traits.family == Family::wait_set &&
         entry->traits.runs_first == TaskKind::timer;
}

/// An executor that rclcpp has from Jazzy on.
bool is_jazzy(const std::string& label) {
  const ExecutorEntry* const entry = registered(label);
  return entry != nullptr && entry->traits.on_rclcpp && entry->traits.on_rclcpp->first >= RosDistro::jazzy;
}

}  // namespace

void export_ctf(const std::string& folder, const std::string& output) {
  check_output_folder(output);
  StoredRun run(folder, "RUN");
  const StoredSystem system = stored_system(run);
  run.load(system.tasks.set);
  for (const Trace& trace : run.traces()) {
    const GraphTasks tasks = system.tasks_of(run, trace.executor, trace.repetition);
    ExportedRun exported{system.graph, tasks, trace, {}, is_jazzy(trace.executor), run.cores()};
    run.check([&] {
      const json& deployments = run.facts().at("deployments");
      if (!deployments.contains(trace.executor)) {
        exported.polled.assign(kMaxWorkers, has_wait_events(trace.executor));
        return;
      }
      for (const json& executor : deployments.at(trace.executor).at("executors")) {
        const auto label = executor.at("executor").get<std::string>();
        exported.polled.insert(exported.polled.end(), executor.at("workers").get<std::size_t>(),
                               has_wait_events(label));
        exported.jazzy = exported.jazzy || is_jazzy(label);
      }
    });
    const bool one = run.traces().size() == 1;
    const fs::path to =
        one ? fs::path(output) : fs::path(output) / concat(trace.executor, "-", trace.repetition);
    if (to.has_parent_path()) create_folder(to.parent_path());
    write_whole_folder(to, [&](const fs::path& part) { write_ctf(part, run_events(exported)); });
  }
}

}  // namespace hotpath
