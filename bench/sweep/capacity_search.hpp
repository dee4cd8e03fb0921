// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::sweep {

/// The quantity that grows from level to level.
enum class Over : std::uint8_t { load, rate, copies };
constexpr auto enum_texts(Over) {
  return std::to_array<EnumText<Over>>(
      {{Over::load, "load"}, {Over::rate, "rate"}, {Over::copies, "copies"}});
}

struct CapacityOptions : simulated::Options {
  Over over = Over::load;
  std::vector<std::string> require = {"no-loss", "deadlines"};
  double from = 5, to = 120, resolution = 1;
  std::uint32_t coarse = 12;
};

/// Searches for the largest level of each executor and deployment, prints the results as a table
/// and writes them, with every tried level, into the output folder. Throws UsageError for too many
/// levels.
void search_capacities(const CapacityOptions& options);

}  // namespace hotpath::sweep
