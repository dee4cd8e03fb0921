// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <stop_token>
#include <string_view>
#include <thread>

#include "bridge.hpp"
#include "master.hpp"
#include "parameters.hpp"
#include "ros_node.hpp"
#include "telemetry_input.hpp"
#include "termination.hpp"
#include "watch_diagnostics.hpp"

using namespace hotpath;
using namespace std::chrono_literals;

namespace {

constexpr int kFailure = 1, kWrongUse = 2;
constexpr auto kTimeOut = 1000ms, kPoll = 500ms;

struct WrongUse : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The master's URI, from the argument `__master:=URI` or else from the environment, like roscpp.
std::string master_uri(int argc, char** argv) {
  constexpr std::string_view kArgument = "__master:=";
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.starts_with(kArgument)) return std::string(argument.substr(kArgument.size()));
  }
  const char* uri = std::getenv("ROS_MASTER_URI");
  if (uri == nullptr || *uri == '\0') {
    throw WrongUse("ROS_MASTER_URI is not set: set it to roscore's address, usually http://localhost:11311");
  }
  return uri;
}

HostAndPort master_address(const std::string& uri) {
  try {
    return parse_uri(uri);
  } catch (const std::invalid_argument& e) {
    throw WrongUse("ROS_MASTER_URI " + std::string(e.what()) + "; usually it is http://localhost:11311");
  }
}

/// Returns false if termination was requested.
bool wait_for_master(const HostAndPort& master, const std::string& uri, const Termination& termination) {
  for (bool said = false; !accepts_connections(master, kTimeOut); said = true) {
    if (!said) {
      std::cerr << "hotpath_ros1_bridge: waiting for a ROS master at " << uri
                << " (start `roscore` there, or set ROS_MASTER_URI)" << std::endl;
    }
    if (termination.wait_for(kPoll)) return false;
  }
  return !termination.requested();
}

/// Throws if a living node has this name: the master would shut that node down when this one
/// starts.
void refuse_namesake(const RosNode& node) {
  const std::string uri = node.namesake();
  if (uri.empty()) return;
  try {
    if (!accepts_connections(parse_uri(uri), kTimeOut)) return;
  } catch (const std::invalid_argument&) {
    return;
  }
  throw WrongUse("a node " + node.name() + " runs already (" + uri +
                 "): give this node another name or namespace, such as __ns:=second");
}

/// Registers the node again whenever roscore is restarted, until a stop is requested.
void watch_master(const std::stop_token& stop, const RosNode& node, const HostAndPort& master,
                  const std::string& uri, const Termination& termination) {
  using Registration = RosNode::Registration;
  for (bool there = true; !stop.stop_requested() && !termination.wait_for(kPoll);) {
    const Registration registration =
        accepts_connections(master, kTimeOut) ? node.registration() : Registration::no_master;
    if (!RosNode::ok()) return;
    if (registration == Registration::no_master && there) {
      RosNode::log(
          RosNode::Severity::warning,
          "the ROS master at " + uri + " has gone; known subscribers go on, waiting for it to come back");
    }
    there = registration != Registration::no_master;
    if (registration == Registration::unknown && node.register_again()) {
      RosNode::log(RosNode::Severity::info, "registered all topics with the new ROS master at " + uri);
    }
  }
}

void run_bridge(RosNode& node, const Parameters& parameters, const Termination& termination) {
  TelemetryInput input(parameters.telemetry);
  Bridge bridge(node, parameters, input);
  auto next_tick = std::chrono::steady_clock::now();
  while (!termination.requested() && RosNode::ok()) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_tick) {
      bridge.tick(now);
      next_tick = now + 1s;
    }
    if (auto event = input.pop(std::min(next_tick, now + 100ms))) bridge.handle(std::move(*event));
  }
}

int run(int argc, char** argv, Termination& termination) {
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
  std::vector<std::string> arguments = without_ros_arguments(argc, argv);
  std::reverse(arguments.begin(), arguments.end());
  arguments.pop_back();  // the program name
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kWrongUse;
  }

  const std::string uri = master_uri(argc, argv);
  const HostAndPort master = master_address(uri);
  if (!wait_for_master(master, uri, termination)) return 0;
  RosNode node(argc, argv, "hotpath_ros1_bridge");
  termination.on_request(RosNode::request_shutdown);
  refuse_namesake(node);
  node.start();
  std::jthread watch(
      [&](const std::stop_token& stop) { watch_master(stop, node, master, uri, termination); });
  if (watch_reports) {
    publish_watch(STDIN_FILENO, [&] { return !termination.requested() && RosNode::ok(); });
    termination.wait_for(kPoll);  // roscpp sends in another thread
    return 0;
  }
  Parameters parameters = read_parameters(node);
  if (domain) parameters.telemetry.domain = *domain;
  run_bridge(node, parameters, termination);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Termination termination;
  try {
    return run(argc, argv, termination);
  } catch (const WrongUse& e) {
    std::cerr << "hotpath_ros1_bridge: " << e.what() << '\n';
    return kWrongUse;
  } catch (const ParameterError& e) {
    std::cerr << "hotpath_ros1_bridge: " << e.what() << '\n';
    return kWrongUse;
  } catch (const std::exception& e) {
    std::cerr << "hotpath_ros1_bridge: " << e.what() << '\n';
    return kFailure;
  }
}
