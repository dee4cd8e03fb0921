// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The highest number of a processor that a file may name: ThreadPlan keeps them as 64 bits.
inline constexpr std::int64_t kMaxProcessor = 63;

/// One executor of a deployment, and how the operating system treats its threads.
struct DeployedExecutor {
  std::string name;      ///< Unique in the deployment.
  std::string executor;  ///< As on the command line: `default`, `cbg:2`, `rm-ro:first`.
  ThreadPolicy policy;
  std::vector<int> processors;  ///< Of its threads; empty: all.
  int line = 0;                 ///< In the deployment's file; 0: there is none.
  std::uint32_t process = 0;    ///< Index into Deployment::processes.
};

/// Which executor serves which tasks of a graph, on which threads: `local` of a task set says it for one
/// executor.
struct Deployment {
  std::string name;
  std::string description;
  std::string file;  ///< Empty for a preset.
  std::vector<DeployedExecutor> executors;
  std::vector<std::uint32_t> executor_of;  ///< By task.
  std::vector<std::string> processes{""};  ///< Names; executors that name none are in one without a name.

  /// The indices of the executors in that process.
  [[nodiscard]] std::vector<std::size_t> executors_in(std::uint32_t process) const;
  /// By node.
  [[nodiscard]] std::vector<std::uint32_t> process_of(const Graph& graph, const GraphTasks& tasks) const;
};

/// A deployment that follows from the graph.
struct DeploymentPreset {
  std::string_view name;
  std::string_view description;
  Deployment (*make)(const Graph&, const GraphTasks&);
};
[[nodiscard]] std::span<const DeploymentPreset> deployment_presets();

/// Throws InputError with the executor's line if Linux cannot bind threads of its policy to processors.
void check_affinity(const DeployedExecutor& executor, const std::string& file);

/// The preset `cie` with the thread policies and processors that a file of Autoware's
/// CallbackIsolatedExecutor (cie_thread_configurator) gives to callback groups; the others keep the ordinary
/// policy. It is called `cie:NAME` after the file. An id is `/NODE@Subscription(/TOPIC)@Timer(NANOSECONDS)`
/// with all callbacks of the group; services, clients, waitables and the subscription to parameter events
/// are left out of the comparison, and an id that fits several groups is for all of them, as with the real
/// one. Throws InputError, for unknown ids as well.
[[nodiscard]] Deployment read_cie(const std::string& path, const Graph& graph, const GraphTasks& tasks);
/// Such a file. Throws std::invalid_argument unless each callback group has an executor of its own.
void write_cie(std::ostream& out, const Graph& graph, const GraphTasks& tasks, const Deployment& deployment);

/// The deployment as a file that find_deployment() reads. Throws std::invalid_argument for what
/// no file can say: callbacks of one group with several executors, and two executors that share nodes and
/// there have callback groups without a name.
[[nodiscard]] std::string deployment_yaml(const Graph& graph, const GraphTasks& tasks,
                                          const Deployment& deployment);

/// The deployment of a graph that a preset's name, `cie:FILE`, the path of a file, or the bare name of a file
/// in the folders of HOTPATH_DEPLOYMENTS or of this program says.
///
///     name, description
///     executors: - name, executor, policy, processors, process, owns
///
/// `owns` is a list of nodes or NODE/GROUP, or `rest` for all that no other executor owns; every callback
/// group has one owner, and every node one process. The executor is `default` unless given, the policy
/// `other`. Throws InputError.
[[nodiscard]] Deployment find_deployment(const std::string& name_or_path, const Graph& graph,
                                         const GraphTasks& tasks);

/// One deployment file of those folders.
struct DeploymentListing {
  std::string name;  ///< What find_deployment takes: the file's name without .yaml.
  std::string description;
  std::string error;  ///< Why the description cannot be read. Owners are not checked: that takes a graph.
};

/// All files that have a bare name, by name, without those that a preset of their name hides.
[[nodiscard]] std::vector<DeploymentListing> list_deployment_files();

}  // namespace hotpath
