// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath::commands {

namespace {

using nlohmann::json;

/// Prints lines without a header, and the rows for --json.
void print(const Table& shown, const Table& stored) {
  std::cout << shown;
  program::show_json(json_of(stored));
}

void print_executors() {
  Table shown("", {"", "", ""}), stored("", {"name", "class", "description", "family", "timers", "policy",
                                             "colour", "compared_by_paper"});
  for (const ExecutorEntry& e : executors()) {
    const ExecutorTraits& t = e.traits;
    shown.add_row({e.name, e.class_name, e.description});
    stored.add_row({e.name, e.class_name, e.description, t.family, t.timers, t.policy, t.colour,
                    json(t.compared_by_paper)});
  }
  print(shown, stored);
}

void print_graphs() {
  Table shown("", {"", "", ""}), stored("", {"name", "nodes", "description", "error"});
  for (const FileListing& g : list_graphs()) {
    const bool valid = g.error.empty();
    shown.add_row({g.name, valid ? std::to_string(g.nodes) + " nodes" : "",
                   valid ? g.description : "invalid: " + g.error});
    stored.add_row({g.name, valid ? json(g.nodes) : json(), valid ? json(g.description) : json(), g.error});
  }
  print(shown, stored);
}

void print_deployments() {
  Table shown("", {"", ""}), stored("", {"name", "description", "error"});
  const auto add = [&](std::string_view name, std::string_view description, const std::string& error) {
    const bool valid = error.empty();
    shown.add_row({name, valid ? std::string(description) : "invalid: " + error});
    stored.add_row({name, valid ? json(description) : json(), error});
  };
  for (const DeploymentPreset& preset : deployment_presets()) add(preset.name, preset.description, "");
  for (const FileListing& d : list_deployment_files()) add(d.name, d.description, d.error);
  print(shown, stored);
}

}  // namespace

const Command kList("Predict", 90, [](CLI::App& app) {
  CLI::App& list =
      add_parent(app, "list", "List the available executors, graphs, deployments or figures of the paper",
                 "hotpath list executors");
  const auto add = [&list](const std::string& name, const std::string& description,
                           void (*print)()) -> auto& {
    return add_command(list, name, description, "hotpath list " + name,
                       [print](const CLI::App&) { print(); });
  };
  add_json_option(add("executors", "Executors: name, rclcpp class, scheduling policy", print_executors));
  add_json_option(add("graphs", "Graphs available by name", print_graphs));
  add_json_option(add("deployments", "Deployments available by name: presets and files", print_deployments));
  add("figures", "Items of `hotpath paper figures` with their durations",
      [] { program::become_python_tool("reproduction-items", {}); });
});

}  // namespace hotpath::commands
