// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "explain/stored_outputs.hpp"
#include "page/columns.hpp"

namespace hotpath::page {

/// The outputs that a page lists: all, or `most` of them: the worst half, and evenly distributed
/// others. In the order of `outputs`.
[[nodiscard]] std::vector<explain::Output> listed(const std::vector<explain::Output>& outputs,
                                                  std::size_t most);

/// Explained outputs of one chain, or jobs of one task, under one executor.
class ListedOutputs {
 public:
  /// Forgets the parts, but not the causes, of all but the worst outputs, which together have at most
  /// `most` parts. Returns whether there are others.
  bool keep_parts(std::size_t most);

  [[nodiscard]] nlohmann::json columns() const;
  /// The time from the origin to the end of the `most` worst outputs, with a margin, by repetition.
  [[nodiscard]] std::map<std::uint32_t, std::vector<Interval>> worst(std::size_t most) const;
  /// The latency ends where the job of the output finishes.
  void add(const explain::Explanation& explanation);

 private:
  [[nodiscard]] std::vector<std::size_t> by_latency() const;

  Columns<5> outputs_{{"repetition", "sequence", "end_ns", "latency_ns", "complete"}};
  std::array<Column, explain::kCauses> causes_;
  Column parts_, steps_;  // by output: how many rows it has below
  Columns<6> part_{{"cause", "rule", "step", "behind", "behind_sequence", "ns"}};
  Columns<2> step_{{"task", "sequence"}};
};

}  // namespace hotpath::page
