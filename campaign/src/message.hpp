// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hotpath {

/// What a thread made of a cell.
struct CellResult {
  std::uint64_t cell = 0;
  std::string row;
  std::string failure;  ///< Not empty: what the exception said.
};

/// What ranks tell each other. Between machines of one architecture.
struct Message {
  enum class Kind : std::uint64_t {
    hello,   ///< To the coordinator: `text` says who, `number` which build and campaign.
    report,  ///< To the coordinator: `results`, and how many cells are wanted: `number`. Also a sign of life.
    cells,   ///< The answer to each hello and report: `cells`, perhaps none.
    stop,    ///< To a rank: no more work; `number` != 0: do not wait for all at the end.
    bye,     ///< The answer to it.
  };
  Kind kind = Kind::report;
  std::uint64_t number = 0;
  std::string text = {};
  std::vector<std::uint64_t> cells = {};
  std::vector<CellResult> results = {};
};

std::string pack(const Message& message);
/// Throws CampaignError for bytes that are no message.
Message unpack(const std::string& bytes);

}  // namespace hotpath
