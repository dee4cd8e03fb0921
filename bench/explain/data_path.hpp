// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "explain/job_window.hpp"
#include "explain/system.hpp"

namespace hotpath::explain {

/// Follows the data of an output backwards through recorded jobs.
class DataPath {
 public:
  DataPath(const System& system, const JobWindow& window) : system_(system), window_(window) {}

  /// The jobs that carried the data of a source's job that started at `source_start` to `sink`, in
  /// order. Where several ways lead there, the one whose data came last. Empty: there is no way.
  [[nodiscard]] std::vector<const Seen*> from_source(const Seen& sink, const ChainIndex& chain,
                                                     Time source_start);
  /// `sink` and the jobs that published the samples that started it, back to the last one that
  /// started at or before `begin`, as far as the trace has them.
  [[nodiscard]] std::vector<const Seen*> of_triggers(const Seen& sink, Time begin) const;

 private:
  /// The samples of a job that count: all, those in the message for one reader, or its own.
  enum class Samples : std::uint8_t { all, of_message, own };

  bool reach(const Seen& job, Samples samples, TaskId reader);
  [[nodiscard]] std::vector<const Seen*> stored_for(const Seen& job, Samples samples, TaskId reader) const;
  [[nodiscard]] const Seen* last_stored(TaskId input, const Seen& job, PublishRule rule) const;

  const System& system_;
  const JobWindow& window_;
  const ChainIndex* chain_ = nullptr;
  Time source_start_{};
  std::set<std::pair<std::uint64_t, bool>> visited_;  // Seen::order; whether only its own sample counts
  std::vector<const Seen*> path_;                     // from the source on
};

}  // namespace hotpath::explain
