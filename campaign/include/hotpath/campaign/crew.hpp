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

/// Parameters of a Crew.
struct CrewOptions {
  unsigned threads = 0;  ///< Threads per rank; 0: one per available processor.
  /// A rank that is silent for longer counts as lost. Ranks report four times as often.
  std::chrono::milliseconds silence{20'000};
  /// The clock for `silence`.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// The threads that work on a campaign: those of this process and, if it was started by mpirun (or
/// another MPI launcher, in builds with MPI), those of all ranks. Only one Crew may exist at a
/// time.
///
/// Rank 0 coordinates and also works. Ranks request cells when they run short; the fewer cells
/// remain, the fewer they get at once. The cells of a silent rank are handed out again. For the
/// others to survive a rank that dies, the launcher must allow it (`mpirun --enable-recovery`). If
/// rank 0 dies, the others end.
class Crew {
 public:
  explicit Crew(const CrewOptions& options);
  /// If run() was not called, tells the other ranks to end.
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Whether this rank gathers the results. Other ranks have no results after run().
  [[nodiscard]] bool coordinates() const;
  [[nodiscard]] unsigned ranks() const;
  [[nodiscard]] unsigned threads() const { return options_.threads; }  ///< Threads of this rank.
  [[nodiscard]] unsigned ranks_on_this_machine() const;

  /// Works until every cell is gathered or the campaign is stopped; all ranks must call it once.
  /// Returns messages about lost ranks. Throws the exception of a cell of this rank or of `gather`,
  /// and CampaignError.
  std::vector<std::string> run(const Campaign& campaign);

 private:
  CrewOptions options_;
  std::unique_ptr<Link> link_;  // nullptr: a single process
  bool ran_ = false;
};

/// A hash that differs between builds of the running program.
[[nodiscard]] std::uint64_t build_fingerprint();

/// Adds bytes to an FNV-1a hash; the same on every machine.
[[nodiscard]] std::uint64_t hash_of(std::string_view bytes, std::uint64_t so_far = 0xcbf29ce484222325);

}  // namespace hotpath
