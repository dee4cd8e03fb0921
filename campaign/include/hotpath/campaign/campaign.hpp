// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace hotpath {

/// A campaign failed for a reason other than its cells: incompatible ranks or a silent coordinator.
struct CampaignError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Numbered cells that are computed in parallel and gathered in one place. A cell depends on its
/// number only, so results depend neither on threads nor on ranks nor on order.
struct Campaign {
  std::string name;  ///< Identifies the work: ranks with different names do not work together.
  std::vector<std::uint64_t> cells;  ///< Distinct numbers, handed out in this order.
  /// Computes a cell's row. Called by any thread of any rank, and twice for a cell whose rank fell
  /// silent. An exception ends the campaign.
  std::function<std::string(std::uint64_t cell)> work;
  /// Receives a row on the coordinating rank: each cell once, one at a time, in order of
  /// completion.
  std::function<void(std::uint64_t cell, const std::string& row)> gather;
  std::function<bool()> stopped = [] { return false; };  ///< Polled regularly: whether to end early.
};

}  // namespace hotpath
