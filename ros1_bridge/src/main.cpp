// SPDX-License-Identifier: Apache-2.0
#include <diagnostic_msgs/DiagnosticArray.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <stdexcept>

#include "bridge.hpp"
#include "messages.hpp"
#include "node_health.hpp"
#include "ros_node.hpp"
#include "termination.hpp"
#include "watch_relay.hpp"

using namespace hotpath;
using namespace std::chrono_literals;

namespace {

constexpr int kFailure = 1, kWrongUse = 2;

/// The master's URI, from the argument `__master:=URI` or else from the environment, like roscpp.
std::string master_uri(int argc, char** argv) {
  const std::string kArgument = "__master:=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(kArgument, 0) == 0) return argument.substr(kArgument.size());
  }
  const char* uri = std::getenv("ROS_MASTER_URI");
  if (uri == nullptr || *uri == '\0') {
    throw std::invalid_argument(
        "ROS_MASTER_URI is not set: set it to roscore's address, usually http://localhost:11311");
  }
  return uri;
}

/// Returns false if termination was requested.
bool wait_for_master(const HostAndPort& master, const std::string& uri) {
  for (bool said = false; !accepts_connections(master, kMasterTimeOut); said = true) {
    if (!said) {
      std::cerr << "hotpath_ros1_bridge: waiting for a ROS master at " << uri
                << " (start `roscore` there, or set ROS_MASTER_URI)" << std::endl;
    }
    if (terminated(kMasterPoll)) return false;
  }
  return !terminated();
}

/// Throws if a living node has this name: the master would shut that node down when this one
/// starts.
void refuse_namesake() {
  const std::string uri = registered_uri();
  if (uri.empty()) return;
  try {
    if (!accepts_connections(parse_uri(uri), kMasterTimeOut)) return;
  } catch (const std::invalid_argument&) {
    return;
  }
  throw std::invalid_argument("a node " + ros::this_node::getName() + " runs already (" + uri +
                              "): give this node another name or namespace, such as __ns:=second");
}

bool goes_on() { return !terminated() && ros::ok(); }

Parameters private_parameters() {
  const std::string node = ros::this_node::getName();
  XmlRpc::XmlRpcValue given;
  ros::param::get(node, given);
  std::string unknown;
  Parameters parameters = read_parameters(given, node, unknown);
  if (!unknown.empty()) ROS_WARN_STREAM(unknown);
  return parameters;
}

void run_bridge(const Parameters& parameters) {
  TelemetryInput input(parameters.telemetry);
  Bridge bridge(parameters, input);
  for (auto next_tick = std::chrono::steady_clock::now(); goes_on();) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_tick) {
      bridge.tick(now);
      next_tick = now + 1s;
    }
    if (auto event = input.pop(std::min(next_tick, now + 100ms))) bridge.handle(std::move(*event));
  }
}

/// Publishes the lines of `hotpath watch --json` from standard input on /diagnostics until they end.
void publish_watch() {
  const ros::Publisher diagnostics = advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics");
  relay_watch(STDIN_FILENO, goes_on, [&](const std::vector<WatchStatus>& statuses) {
    diagnostic_msgs::DiagnosticArray message;
    message.header = header(now_ns(), "");
    for (const WatchStatus& status : statuses) {
      diagnostic_msgs::DiagnosticStatus& to = message.status.emplace_back();
      to.level = static_cast<std::int8_t>(status.level);
      to.name = status.name;
      to.message = status.message;
      for (const auto& [key, value] : status.values) add_value(to, key, value);
    }
    diagnostics.publish(message);
  });
  terminated(kMasterPoll);  // roscpp sends in another thread
}

int run(int argc, char** argv) {
  CLI::App app(
      "Shows a running benchmark (`hotpath run --live`) in ROS 1: reads its telemetry from Fast DDS and "
      "publishes it on ROS topics. All settings are private ROS parameters (`_domain:=7`), described in "
      "ros1_bridge/README.md.",
      "hotpath_ros1_bridge");
  bool watch_reports = false;
  app.add_flag("--watch", watch_reports,
               "Publish the lines of `hotpath watch --json` from standard input on /diagnostics instead");
  std::optional<std::uint32_t> domain;
  app.add_option("--domain", domain,
                 "DDS domain of the benchmark, 0 to 232 (default: parameter ~domain, else 0)")
      ->check(CLI::Range(0, 232))
      ->excludes("--watch");
  ros::V_string arguments;  // without those of ROS, and without the program's name
  ros::removeROSArgs(argc, argv, arguments);
  std::reverse(arguments.begin(), arguments.end());
  arguments.pop_back();
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kWrongUse;
  }

  const std::string uri = master_uri(argc, argv);
  const HostAndPort master = parse_uri(uri);
  if (!wait_for_master(master, uri)) return 0;
  // Line buffering: otherwise rosconsole's output stays in a buffer if standard output is a file or
  // a pipe.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  ros::init(argc, argv, "hotpath_ros1_bridge", ros::init_options::NoSigintHandler);
  refuse_namesake();
  const ros::NodeHandle node;    // shuts ROS down at the end
  ros::AsyncSpinner spinner(1);  // latched messages reach new subscribers through its queue
  spinner.start();
  const Registration registration(master);
  if (watch_reports) {
    publish_watch();
    return 0;
  }
  Parameters parameters = private_parameters();
  if (domain) parameters.telemetry.domain = *domain;
  run_bridge(parameters);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  handle_termination();
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "hotpath_ros1_bridge: " << e.what() << '\n';
    return dynamic_cast<const std::invalid_argument*>(&e) != nullptr ? kWrongUse : kFailure;
  }
}
