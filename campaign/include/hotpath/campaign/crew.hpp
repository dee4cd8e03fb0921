// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/campaign/campaign.hpp"

namespace hotpath {

class Link;

struct CrewOptions {
  unsigned threads = 0;  ///< Of each rank; 0: one for each processor that it may use.
  /// A rank from which nothing was heard for so long counts as lost. Ranks report four times as often.
  std::chrono::milliseconds silence{20'000};
  /// The clock that silence is measured with.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// Who works on a campaign: the threads of this process and, when it was started by mpirun (or another
/// launcher of MPI processes, where the build found MPI), those of all ranks. One at a time.
///
/// Rank 0 coordinates and works as well: ranks ask for cells when they run short, and get the fewer at once
/// the fewer are left. The cells of a rank that falls silent are handed out again; for others to survive a
/// rank that dies, the launcher must let them (`mpirun --enable-recovery`). Without rank 0 the others end.
class Crew {
 public:
  explicit Crew(const CrewOptions& options);
  /// Where there was no run(), ranks take leave of each other.
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Whether this is the rank that gathers. Others have nothing to say after run().
  [[nodiscard]] bool coordinates() const;
  [[nodiscard]] unsigned ranks() const;
  [[nodiscard]] unsigned threads() const { return options_.threads; }  ///< Of this rank.
  [[nodiscard]] unsigned ranks_on_this_machine() const;

  /// Works until every cell is gathered, or the campaign was stopped; to be called once, by all ranks.
  /// Returns sentences about ranks that were lost. Throws what a cell of this rank or `gather` threw, and
  /// CampaignError.
  std::vector<std::string> run(const Campaign& campaign);

 private:
  CrewOptions options_;
  std::unique_ptr<Link> link_;  // none: alone
  bool ran_ = false;
};

/// Differs between builds of the running program.
[[nodiscard]] std::uint64_t build_fingerprint();

/// Mixes bytes into a hash: FNV-1a, the same on every machine.
[[nodiscard]] std::uint64_t hash_of(std::string_view bytes, std::uint64_t so_far = 0xcbf29ce484222325);

}  // namespace hotpath
