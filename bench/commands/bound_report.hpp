// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "bounds/bounds.hpp"
#include "commands/observed.hpp"
#include "program/text_table.hpp"

namespace hotpath {

/// `-` for none.
std::string in_ms(const std::optional<Duration>& d);

/// The bounds of a graph's tasks and chains, beside what a run observed, if there is one.
class BoundReport {
 public:
  /// Graph and tasks must outlive it.
  BoundReport(const Graph& graph, const GraphTasks& tasks, std::optional<Observed> observed)
      : graph_(graph), tasks_(tasks), observed_(std::move(observed)) {}

  /// To standard output.
  void print(const BoundSet& set);

  /// Observed values that exceed their bound.
  std::size_t violations() const { return violations_; }
  /// Every row so far.
  std::string csv() const;

 private:
  struct Row {
    const char* kind;
    std::string name;
    std::optional<Duration> bound, observed;
  };
  TextTable table(const std::string& what, std::vector<std::string> more) const;
  void print_tasks(const BoundSet& set);
  void print_chains(const BoundSet& set);
  void print_verdict(const BoundSet& set) const;
  /// Completes the cells with what was observed.
  void add_row(TextTable& rows, std::vector<TextTable::Cell> cells, const BoundSet& set, const Row& row);

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::optional<Observed> observed_;
  std::ostringstream csv_;
  std::size_t violations_ = 0;
};

}  // namespace hotpath
