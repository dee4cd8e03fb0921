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

void print_executors() {
  program::Table table("", {"", "", ""});
  json all = json::array();
  for (const ExecutorEntry& e : executors()) {
    const ExecutorTraits& t = e.traits;
    table.add_row({std::string(e.name), std::string(e.class_name), std::string(e.description)});
    all.push_back({{"name", e.name},
                   {"class", e.class_name},
                   {"description", e.description},
                   {"family", to_string(t.family)},
                   {"timers", to_string(t.timers)},
                   {"policy", t.policy ? json(to_string(*t.policy)) : json()},
                   {"colour", t.colour},
                   {"compared_by_paper", t.compared_by_paper}});
  }
  std::cout << table;
  program::show_json(all);
}

void print_graphs() {
  program::Table graphs("", {"", "", ""});
  json all = json::array();
  for (const GraphListing& g : list_graphs()) {
    const bool valid = g.error.empty();
    graphs.add_row({g.name, valid ? std::to_string(g.nodes) + " nodes" : "",
                    valid ? g.description : "invalid: " + g.error});
    all.push_back({{"name", g.name},
                   {"nodes", valid ? json(g.nodes) : json()},
                   {"description", valid ? json(g.description) : json()},
                   {"error", valid ? json() : json(g.error)}});
  }
  std::cout << graphs;
  program::show_json(all);
}

void print_deployments() {
  program::Table deployments("", {"", ""});
  json all = json::array();
  const auto add = [&](const std::string& name, const std::string& description, const std::string& error) {
    deployments.add_row({name, error.empty() ? description : "invalid: " + error});
    all.push_back({{"name", name},
                   {"description", error.empty() ? json(description) : json()},
                   {"error", error.empty() ? json() : json(error)}});
  };
  for (const DeploymentPreset& preset : deployment_presets()) {
    add(std::string(preset.name), std::string(preset.description), "");
  }
  for (const DeploymentListing& d : list_deployment_files()) add(d.name, d.description, d.error);
  std::cout << deployments;
  program::show_json(all);
}

}  // namespace

void add_list_command(CLI::App& app) {
  CLI::App* list =
      app.add_subcommand("list", "List the available executors, graphs, deployments or figures of the paper");
  list->footer("");
  list->require_subcommand(1);
  const auto add = [list](const std::string& name, const std::string& description, void (*print)()) {
    CLI::App& command = *list->add_subcommand(name, description);
    command.callback(print);
    add_json_option(command);
  };
  add("executors", "Executors: name, rclcpp class, scheduling policy", print_executors);
  add("graphs", "Graphs available by name", print_graphs);
  add("deployments", "Deployments available by name: presets and files", print_deployments);
  list->add_subcommand("figures", "Items of `hotpath paper figures` with their durations")->callback([] {
    program::become_python_tool("reproduce", {"--list"});
  });
}

const Command kList("Predict", 90, add_list_command);

}  // namespace hotpath::commands
