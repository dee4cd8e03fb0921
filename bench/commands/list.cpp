// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/json_output.hpp"
#include "program/python_tool.hpp"
#include "program/table.hpp"

namespace hotpath::commands {

namespace {

using nlohmann::json;
using program::Table, program::Value;

/// Prints lines without a header, and the rows for --json.
void print(const Table& shown, const Table& stored) {
  std::cout << shown;
  program::show_json(json_of(stored));
}

void print_executors() {
  Table shown("", {"", "", ""});
  Table stored("",
               {"name", "class", "description", "family", "timers", "policy", "colour", "compared_by_paper"});
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
  for (const GraphListing& g : list_graphs()) {
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
    shown.add_row({name, valid ? Value(description) : "invalid: " + error});
    stored.add_row({name, valid ? json(description) : json(), error});
  };
  for (const DeploymentPreset& preset : deployment_presets()) add(preset.name, preset.description, "");
  for (const DeploymentListing& d : list_deployment_files()) add(d.name, d.description, d.error);
  print(shown, stored);
}

}  // namespace

const Command kList("Predict", 90, [](CLI::App& app) {
  CLI::App* list =
      app.add_subcommand("list", "List the available executors, graphs, deployments or figures of the paper");
  list->footer("Example:  hotpath list executors");
  list->require_subcommand(1);
  const auto add = [list](const std::string& name, const std::string& description, void (*print)()) {
    CLI::App& command = *list->add_subcommand(name, description);
    command.callback(print);
    command.footer("Example:  hotpath list " + name);
    add_json_option(command);
  };
  add("executors", "Executors: name, rclcpp class, scheduling policy", print_executors);
  add("graphs", "Graphs available by name", print_graphs);
  add("deployments", "Deployments available by name: presets and files", print_deployments);
  list->add_subcommand("figures", "Items of `hotpath paper figures` with their durations")
      ->footer("Example:  hotpath list figures")
      ->callback([] { program::become_python_tool("reproduction-items", {}); });
});

}  // namespace hotpath::commands
