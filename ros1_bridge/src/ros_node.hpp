// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace hotpath {

/// A parameter has a value that it must not have.
struct ParameterError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The arguments without those that are ROS's own (`name:=value`).
std::vector<std::string> without_ros_arguments(int argc, char** argv);

/// This process as a node of ROS 1, without ROS's headers. Handles no signals.
class RosNode {
 public:
  /// Takes ROS's own arguments; `name` is the default of `__name:=`. Only when a master answers: otherwise
  /// waits for one.
  RosNode(int& argc, char** argv, const std::string& name);
  ~RosNode();
  RosNode(const RosNode&) = delete;
  RosNode& operator=(const RosNode&) = delete;

  /// Becomes known to the master: a namesake is told to end.
  void start();

  std::string name() const;        ///< With its namespace: /left/hotpath_ros1_bridge
  std::string name_space() const;  ///< /left, or / alone.

  /// Ends what waits for the master. May be called from any thread.
  static void request_shutdown();
  /// False once ROS has told the node to end: `rosnode kill`, or another node with its name.
  static bool ok();

  /// Private parameters, of a node that was started; nothing when unset. Throw ParameterError that says what
  /// is wrong.
  std::optional<bool> boolean(const std::string& parameter) const;
  std::optional<double> number(const std::string& parameter) const;
  std::optional<std::int64_t> integer(const std::string& parameter) const;
  std::optional<std::string> string(const std::string& parameter) const;
  /// A list of strings, or one string with commas.
  std::optional<std::vector<std::string>> strings(const std::string& parameter) const;
  /// Names of all private parameters that are set, as `a` or `a/b`.
  std::vector<std::string> parameters() const;
  static bool uses_simulated_time();

  enum class Registration { no_master, unknown, registered };
  /// What the master knows of this node.
  Registration registration() const;
  /// Tells a new master of all topics; connections to subscribers stay as they are. False: the master has
  /// gone.
  bool register_again() const;
  /// URI of the node that the master knows by the name that this process would get; empty: none.
  std::string namesake() const;

  enum class Severity { info, warning, error };
  static void log(Severity severity, const std::string& text);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hotpath
