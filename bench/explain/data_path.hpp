// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "explain/job_window.hpp"
#include "explain/system.hpp"

namespace hotpath::explain {

/// Follows the data of an output backwards through recorded jobs.
class DataPath {
 public:
  /// `chain`: index into System::chains(); std::nullopt: only of_triggers() is used.
  DataPath(const System& system, const JobWindow& window, std::optional<std::uint32_t> chain);

  /// Notes the sets that a started job completes. Jobs are added in order of start.
  void add(const Seen& job);
  /// Forgets all jobs.
  void clear();

  /// The jobs that carried the data of a source's job that started at `source_start` to `sink`, in
  /// order. Where several ways lead there, the one whose data came last. Empty: there is no way.
  [[nodiscard]] std::vector<const Seen*> from_source(const Seen& sink, Time source_start);
  /// `sink` and the jobs that published the samples that started it, back to the last one that
  /// started at or before `begin`, as far as the trace has them.
  [[nodiscard]] std::vector<const Seen*> of_triggers(const Seen& sink, Time begin) const;

 private:
  static constexpr std::size_t kOwn = ~std::size_t{0};  ///< The sample that a job took, not a publication.
  /// A set of the sink's node, with the inputs that have a sample.
  struct Set {
    Publication what;
    std::set<std::uint32_t> inputs;
  };

  [[nodiscard]] const std::vector<Publication>& publications_of(const Seen& job) const {
    return system_.tasks().callbacks[job.record.job.task].publishes;
  }
  [[nodiscard]] std::vector<std::size_t> messages_of(const Seen& sink) const;
  bool reach(const Seen& job, std::size_t publication);
  [[nodiscard]] std::vector<const Seen*> stored_for(const Seen& job, std::size_t publication) const;
  [[nodiscard]] const Seen* last_stored(TaskId input, const Seen& job, const Publication& publication) const;

  const System& system_;
  const JobWindow& window_;
  const ChainIndex* const chain_;
  std::vector<Set> sets_;
  std::set<std::pair<std::uint64_t, std::size_t>> completed_;  // Seen::order and publication
  Time source_start_{};
  std::set<std::pair<std::uint64_t, std::size_t>> visited_;  // the same
  std::vector<const Seen*> path_;                            // from the source on
};

}  // namespace hotpath::explain
