// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace hotpath {

/// A parameter has an invalid value.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The arguments without ROS remappings (`name:=value`).
std::vector<std::string> without_ros_arguments(int argc, char** argv);

/// This process as a ROS 1 node, without ROS headers. Does not handle signals.
class RosNode {
 public:
  /// Parses the ROS arguments; `name` is the default of `__name:=`. Blocks until a master answers.
  RosNode(int& argc, char** argv, const std::string& name);
  ~RosNode();
  RosNode(const RosNode&) = delete;
  RosNode& operator=(const RosNode&) = delete;

  /// Registers with the master, which shuts down a node of the same name.
  void start();

  std::string name() const;        ///< With its namespace: /left/hotpath_ros1_bridge
  std::string name_space() const;  ///< /left, or / without a namespace.

  /// Ends calls that wait for the master. Callable from any thread.
  static void request_shutdown();
  /// False once ROS has shut the node down: by `rosnode kill`, or because of another node with its
  /// name.
  static bool ok();

  // Private parameters; call after start(). Each returns std::nullopt if unset and throws
  // ParameterError for a wrong type.
  std::optional<bool> boolean(const std::string& parameter) const;
  std::optional<double> number(const std::string& parameter) const;
  std::optional<std::int64_t> integer(const std::string& parameter) const;
  std::optional<std::string> string(const std::string& parameter) const;
  /// A list of strings, or one comma-separated string.
  std::optional<std::vector<std::string>> strings(const std::string& parameter) const;
  /// Names of all private parameters that are set, as `a` or `a/b`.
  std::vector<std::string> parameters() const;
  static bool uses_simulated_time();

  enum class Registration { no_master, unknown, registered };
  /// Whether the master knows this node.
  Registration registration() const;
  /// Registers all topics with a new master; connections to subscribers persist. Returns false if
  /// the master is gone.
  bool register_again() const;
  /// URI of the registered node with the name of this process; empty: none.
  std::string namesake() const;

  enum class Severity { info, warning, error };
  static void log(Severity severity, const std::string& text);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hotpath
