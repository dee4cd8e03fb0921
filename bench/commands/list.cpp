// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/shown_text.hpp"
#include "program/text_table.hpp"

namespace hotpath::commands {

namespace {

void print_executors() {
  program::TextTable table("", {"", "", ""});
  for (const ExecutorEntry& e : executors()) {
    table.add_row({std::string(e.name), std::string(e.class_name), std::string(e.description)});
  }
  std::cout << table;
}

/// The properties of executors that figures need.
void print_executors_json() {
  nlohmann::json all = nlohmann::json::array();
  for (const ExecutorEntry& e : executors()) {
    const ExecutorTraits& t = e.traits;
    all.push_back({{"name", e.name},
                   {"class", e.class_name},
                   {"description", e.description},
                   {"family", to_string(t.family)},
                   {"timers", to_string(t.timers)},
                   {"policy", t.policy ? nlohmann::json(to_string(*t.policy)) : nlohmann::json()},
                   {"colour", t.colour},
                   {"compared_by_paper", t.compared_by_paper}});
  }
  program::data_output() << all.dump(2) << "\n";
}

void print_graphs() {
  program::TextTable graphs("", {"", "", ""});
  for (const GraphListing& g : list_graphs()) {
    const bool valid = g.error.empty();
    graphs.add_row({g.name, valid ? std::to_string(g.nodes) + " nodes" : "",
                    valid ? g.description : "invalid: " + g.error});
  }
  std::cout << graphs;
}

void print_deployments() {
  program::TextTable deployments("", {"", ""});
  for (const DeploymentPreset& preset : deployment_presets()) {
    deployments.add_row({std::string(preset.name), std::string(preset.description)});
  }
  for (const DeploymentListing& d : list_deployment_files()) {
    deployments.add_row({d.name, d.error.empty() ? d.description : "invalid: " + d.error});
  }
  std::cout << deployments;
}

}  // namespace

void add_list_command(CLI::App& app) {
  CLI::App* list = app.add_subcommand("list", "List the available executors, graphs or deployments");
  list->require_subcommand(1);
  auto [executors, json] =
      add_command<bool>(*list, "executors", "Executors: name, rclcpp class, scheduling policy", "",
                        [](bool as_json) { as_json ? print_executors_json() : print_executors(); });
  executors.add_flag("--json", json, "Print JSON, with family, policy and figure colour");
  list->add_subcommand("graphs", "Graphs available by name")->callback(print_graphs);
  list->add_subcommand("deployments", "Deployments available by name: presets and files")
      ->callback(print_deployments);
}

}  // namespace hotpath::commands
