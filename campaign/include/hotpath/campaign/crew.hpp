// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace hotpath {

/// Numbered cells that are computed in parallel and gathered in one place. A cell depends on its
/// number only, so results depend neither on threads nor on ranks nor on order.
struct Campaign {
  std::string name;  ///< Identifies the work: ranks with different names do not work together.
  std::vector<std::uint64_t> cells;  ///< Distinct numbers, handed out in this order.
  /// Computes a cell's row. Called by any thread of any rank. An exception ends the campaign.
  std::function<std::string(std::uint64_t cell)> work;
  /// Receives a row on the coordinating rank: each cell once, one at a time, in order of
  /// completion.
  std::function<void(std::uint64_t cell, const std::string& row)> gather;
  std::function<bool()> stopped = [] { return false; };  ///< Polled regularly: whether to end early.
};

/// The threads that work on a campaign: those of this process and, if an MPI launcher started it (in
/// builds with MPI), those of all ranks, once in a process.
///
/// Rank 0 coordinates and also works. It hands out cells to ranks that run short; the fewer remain,
/// the fewer at once. If a rank dies, the launcher ends the job; a rank that leaves an incomplete
/// campaign ends the job when its process exits.
class Crew {
 public:
  explicit Crew(unsigned threads = 0);  ///< Threads per rank; 0: one per available processor.
  /// After a complete campaign, waits until every rank has ended.
  ~Crew();

  /// Whether this rank gathers the results. Other ranks have no results after run().
  [[nodiscard]] bool coordinates() const { return rank_ == 0; }
  [[nodiscard]] unsigned ranks() const { return static_cast<unsigned>(threads_of_.size()); }
  [[nodiscard]] unsigned ranks_on_this_machine() const { return ranks_on_this_machine_; }
  [[nodiscard]] unsigned threads() const { return threads_; }  ///< Threads of this rank.

  /// Works until every cell is gathered or the campaign is stopped; all ranks must call it once.
  /// Throws the exception of a cell of this rank or of `gather`, and std::runtime_error if ranks run
  /// different programs or campaigns.
  void run(const Campaign& campaign);

 private:
  class Messages;
  void work_for_coordinator(const Campaign& campaign);

  unsigned threads_, rank_ = 0, ranks_on_this_machine_ = 1;
  std::unique_ptr<Messages> messages_;
  std::vector<std::size_t> threads_of_;  // by rank; 0: it has not reported yet
  bool complete_ = false;
};

/// A hash that differs between builds of the running program.
[[nodiscard]] std::uint64_t build_fingerprint();

/// Adds bytes to an FNV-1a hash; the same on every machine.
[[nodiscard]] std::uint64_t hash_of(std::string_view bytes, std::uint64_t so_far = 0xcbf29ce484222325);

}  // namespace hotpath
