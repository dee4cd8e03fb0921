// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace hotpath {

/// A campaign that cannot go on for another reason than its cells: ranks that do not belong together, a
/// coordinator that fell silent.
struct CampaignError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Numbered cells, each of which is computed somewhere and gathered in one place. A cell is a function of its
/// number alone, so that results depend neither on threads nor on ranks nor on order.
struct Campaign {
  std::string name;                  ///< What is done: ranks of which it differs do not work together.
  std::vector<std::uint64_t> cells;  ///< All different; they are handed out in this order.
  /// What a cell has to say. Called by any thread of any rank, and twice for a cell whose rank fell silent.
  /// An exception ends the campaign.
  std::function<std::string(std::uint64_t cell)> work;
  /// Takes a row on the coordinating rank: each cell once, one after the other, in whatever order they end.
  std::function<void(std::uint64_t cell, const std::string& row)> gather;
  std::function<bool()> stopped = [] { return false; };  ///< Asked now and then: whether to end early.
};

}  // namespace hotpath
