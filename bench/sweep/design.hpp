// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath::sweep {

/// An option of the command that a sweep runs, its value, and its line in the sweep file.
struct Option {
  std::string name;  ///< Without the dashes.
  std::string value;
  int line = 0;
};

/// An option whose values a sweep varies.
struct Axis {
  std::string name;
  int line = 0;
  std::vector<std::string> listed;  ///< Empty: `steps` numbers in equal steps.
  double from = 0, step = 0;
  std::size_t steps = 0;

  [[nodiscard]] std::size_t size() const { return listed.empty() ? steps : listed.size(); }
  /// The i-th value, i < size().
  [[nodiscard]] std::string value(std::size_t i) const;
  /// Whether the i-th value must be checked. A command that accepts the ends of a range accepts all of it.
  [[nodiscard]] bool is_checked(std::size_t i) const { return !listed.empty() || i <= 1 || i + 1 == steps; }
};

/// The content of a sweep file: the cells, and how each is computed. A cell is a point of the grid
/// of all axes and a repetition; both follow from its number.
struct Design {
  std::string file, text;
  std::string command;  ///< simulate, run or analyze.
  std::vector<Option> fixed;
  std::vector<Axis> axes;  ///< The last one changes fastest.
  std::uint64_t points = 1;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  bool keep = false;  ///< The run folders of all cells.

  [[nodiscard]] std::uint64_t cells() const { return points * repetitions; }
  [[nodiscard]] std::uint32_t repetition(std::uint64_t cell) const {
    return static_cast<std::uint32_t>(cell % repetitions);
  }
  /// The values of the axes, in their order.
  [[nodiscard]] std::vector<Option> coordinates(std::uint64_t cell) const;
  /// The seed of a cell, from its coordinates and repetition. Executor and deployment do not enter,
  /// so that all of them meet the same phases and execution times.
  [[nodiscard]] std::uint64_t seed_of(std::uint64_t cell) const;
};

/// Limit on the cells of a design, whose rows are kept in memory.
inline constexpr std::uint64_t kMostCells = 1'000'000;

/// Whether an option sets executors or deployments, which have columns among the measures.
[[nodiscard]] bool names_executor(const std::string& option);

/// Throws InputError with file and line for unknown keys and for axes that contradict each other.
/// It does not check that the command has the options.
[[nodiscard]] Design load_sweep(const std::string& file);

}  // namespace hotpath::sweep
