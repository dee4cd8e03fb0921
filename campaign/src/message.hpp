// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath {

/// The result of a cell.
struct CellResult {
  std::uint64_t cell = 0;
  std::string row;
  std::string failure;  ///< Message of the exception; empty if the cell succeeded.
};

/// A message between ranks, on machines of one architecture.
struct Message {
  enum class Kind : std::uint64_t {
    hello,   ///< To the coordinator: `text` is the host, `number` the build and campaign.
    report,  ///< To the coordinator: `results`, and in `number` the cells wanted. Also a sign of life.
    cells,   ///< Answer to each hello and report: `cells`, possibly none.
    stop,    ///< To a rank: no more work. `number` != 0: do not wait for all ranks at the end.
    bye,     ///< Answer to stop.
  };
  Kind kind = Kind::report;
  std::uint64_t number = 0;
  std::string text = {};
  std::vector<std::uint64_t> cells = {};
  std::vector<CellResult> results = {};
};

std::string pack(const Message& message);
/// Throws CampaignError for an invalid message.
Message unpack(const std::string& bytes);

}  // namespace hotpath
