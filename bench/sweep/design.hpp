// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace hotpath {

/// An option of the command that a sweep runs, with the value that it has in a cell, and where that stands.
struct SweepOption {
  std::string name;  ///< Without the dashes.
  std::string value;
  int line = 0;

  friend bool operator==(const SweepOption&, const SweepOption&) = default;
};

/// An option whose values a sweep goes through: those listed, or numbers from `low` to `high`.
struct SweepAxis {
  std::string name;
  int line = 0;
  std::vector<std::string> listed;
  double low = 0, high = 0;
  double step = 0;  ///< 0: any number of the range, drawn at random.

  /// How many values there are, 0 if any number is one.
  [[nodiscard]] std::uint64_t size() const;
  /// The i-th of them, from 0.
  [[nodiscard]] std::string value(std::uint64_t i) const;
  /// Enough values to find those that a command refuses: of a range its ends, and the first step if it has
  /// any.
  [[nodiscard]] std::vector<std::string> examples() const;
  /// A value as the axis writes it, `20` for `20.0`; empty if it has no such value.
  [[nodiscard]] std::string named(const std::string& wanted) const;
  /// Whether neighbours of a range with a step read differently.
  [[nodiscard]] bool values_differ() const;
};

/// What a sweep file says: which cells there are, and how each is to be computed. A cell is a point of the
/// axes and a repetition; its number decides all of it.
struct SweepDesign {
  std::string file, text;
  std::string command;  ///< simulate, run or analyze.
  std::vector<SweepOption> fixed;
  std::vector<SweepAxis> axes;  ///< The last one changes fastest.
  std::uint64_t points = 0;     ///< Of the grid, or drawn at random.
  bool random = false;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  bool keep_all = false;
  std::vector<std::vector<SweepOption>> keep;  ///< Coordinates of cells whose folders are kept.

  [[nodiscard]] std::uint64_t cells() const { return points * repetitions; }
  [[nodiscard]] std::uint32_t repetition(std::uint64_t cell) const {
    return static_cast<std::uint32_t>(cell % repetitions);
  }
  /// The values of the axes, in their order.
  [[nodiscard]] std::vector<SweepOption> coordinates(std::uint64_t cell) const;
  /// The seed of a cell: of its coordinates and repetition, except the executor or deployment, so that all of
  /// these meet the same phases and execution times.
  [[nodiscard]] std::uint64_t seed_of(std::uint64_t cell) const;
  [[nodiscard]] bool keeps(std::uint64_t cell) const;
};

/// Most cells of a design: their numbers are kept in memory.
inline constexpr std::uint64_t kMostCells = 100'000'000;

/// Whether an option names what schedules the graph.
[[nodiscard]] bool names_executor(const std::string& option);

/// Throws InputError with file and line for unknown keys and for axes that contradict each other. Whether the
/// command has the options is not checked here.
[[nodiscard]] SweepDesign load_sweep(const std::string& file);

}  // namespace hotpath
