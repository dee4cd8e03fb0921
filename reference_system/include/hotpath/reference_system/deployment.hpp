// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

/// The largest processor number in a file: ThreadPlan stores processors as 64 bits.
inline constexpr std::int64_t kMaxProcessor = 63;
class YamlValue;
/// The processors in a list, each once; `item` names one of them. Throws InputError.
[[nodiscard]] std::vector<int> read_processors(const YamlValue& list, const std::string& item);

/// One executor of a deployment, and how the operating system treats its threads.
struct DeployedExecutor {
  std::string name;      ///< Unique in the deployment.
  std::string executor;  ///< As on the command line: `default`, `cbg:2`, `rm-ro:first`.
  ThreadPolicy policy;
  std::vector<int> processors;  ///< Processors of the threads; empty: all.
  int line = 0;                 ///< Line in the deployment's file; 0: no file.
  std::uint32_t process = 0;    ///< Index into Deployment::processes.
};

/// Assigns the tasks of a graph to executors and threads. `Task::local` expresses this for one
/// executor.
struct Deployment {
  std::string name;
  std::string description;
  std::string file;  ///< Empty for a preset.
  std::vector<DeployedExecutor> executors;
  std::vector<std::uint32_t> executor_of;  ///< By task.
  std::vector<std::string> processes{""};  ///< Names; executors without one share an unnamed process.

  /// By node.
  [[nodiscard]] std::vector<std::uint32_t> process_of(const Graph& graph, const GraphTasks& tasks) const;
};

/// A deployment derived from the graph.
struct DeploymentPreset {
  std::string_view name;
  std::string_view description;
  Deployment (*make)(const Graph&, const GraphTasks&);
};
/// All presets, in listing order.
[[nodiscard]] std::span<const DeploymentPreset> deployment_presets();

/// Throws InputError with the executor's line if Linux cannot pin threads of its policy to
/// processors.
void check_affinity(const DeployedExecutor& executor, const std::string& file);

/// Reads the preset `cie` with the thread policies and processors that a file of Autoware's
/// CallbackIsolatedExecutor (cie_thread_configurator) assigns to callback groups; other groups keep
/// the ordinary policy. The deployment is called `cie:NAME` after the file. An id is
/// `/NODE@Subscription(/TOPIC)@Timer(NANOSECONDS)` with all callbacks of the group. The comparison
/// ignores services, clients, waitables and the subscription to parameter events. An id that
/// matches several groups applies to all of them, as in the real executor. Throws InputError, also
/// for unknown ids.
[[nodiscard]] Deployment read_cie(const std::string& path, const Graph& graph, const GraphTasks& tasks);
/// Writes such a file. Throws std::invalid_argument unless each callback group has its own
/// executor.
void write_cie(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment);

/// The deployment as the text of a file that find_deployment() reads. Throws std::invalid_argument
/// if a file cannot express it: callbacks of one group belong to several executors, or two
/// executors share a node with unnamed callback groups.
[[nodiscard]] std::string deployment_yaml(const Graph& graph, const GraphTasks& tasks,
                                          const Deployment& deployment);

/// Finds the deployment for a graph, by a preset's name, `cie:FILE`, the path of a file, or the bare
/// name of a file in the folders of HOTPATH_DEPLOYMENTS or of this program.
///
///     name, description
///     executors: - name, executor, policy, processors, process, owns
///
/// `owns` is a list of NODE or NODE/GROUP, or `rest` for everything that no other executor owns. Every
/// callback group has one owner, and every node one process. Defaults: executor `default`, policy
/// `other`. Throws InputError.
[[nodiscard]] Deployment find_deployment(const std::string& name_or_path, const Graph& graph,
                                         const GraphTasks& tasks);

/// All files that are available by bare name, sorted by name, except those hidden by a preset of
/// the same name.
[[nodiscard]] std::vector<FileListing> list_deployment_files();

}  // namespace hotpath
