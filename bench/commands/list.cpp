// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "commands/commands.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

void list_executors() {
  for (const ExecutorEntry& e : executors()) {
    std::printf("%-10.*s %-29.*s %.*s\n", static_cast<int>(e.name.size()), e.name.data(),
                static_cast<int>(e.class_name.size()), e.class_name.data(),
                static_cast<int>(e.description.size()), e.description.data());
  }
}

void print_graphs() {
  for (const GraphListing& g : list_graphs()) {
    if (g.error.empty()) {
      std::printf("%-30s %3zu nodes  %s\n", g.name.c_str(), g.nodes, g.description.c_str());
    } else {
      std::printf("%-30s invalid: %s\n", g.name.c_str(), g.error.c_str());
    }
  }
}

}  // namespace

void add_list_command(CLI::App& app) {
  CLI::App* list = app.add_subcommand("list", "What there is to choose from");
  list->require_subcommand(1);
  list->add_subcommand("executors", "Names, rclcpp's classes, how they schedule")->callback(list_executors);
  list->add_subcommand("graphs", "Graphs that go by a bare name")->callback(print_graphs);
}

}  // namespace hotpath
