// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "import/chain_follower.hpp"
#include "program/latency_histogram.hpp"
#include "watch/judge.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

/// What was observed of a chain since the beginning.
struct ObservedChain {
  /// Of each output, a job of a sink that ended with data of the sources: start of the latest source's job
  /// to the start of the sink's.
  program::LatencyHistogram hot_path;
  program::LatencyHistogram age;  ///< Timestamp of the oldest source's job to the end of the sink's.
};

/// Follows the data of a contract's chains through the jobs of a running system.
class ChainCheck {
 public:
  /// The contract and the judge must outlive it.
  ChainCheck(const Contract& contract, const StatedNames& names, Judge& judge);
  ChainCheck(const ChainCheck&) = delete;
  ChainCheck& operator=(const ChainCheck&) = delete;

  // In the order of time. `entry`: the job's callback in the contract; `publisher`: that of its
  // sample, kNone: unknown.
  void started(std::uint32_t entry, const tracing::Job& job, std::uint32_t publisher,
               std::optional<Time> timestamp);
  /// `topic`: its number among the stated ones.
  void published(const tracing::Job& job, std::uint32_t topic) { follower_.publish(job.ref, topic); }
  /// `judged`: whether the outputs of the job are compared with the contract.
  void ended(const tracing::Job& job, bool judged);

  /// By chain of the contract.
  [[nodiscard]] const std::vector<ObservedChain>& chains() const { return observed_; }

 private:
  /// Jobs of a source that data may still come from.
  static constexpr std::size_t kRemembered = 4096;

  imports::ChainFollower follower(const StatedNames& names);
  void end(const ChainObservation& output, const tracing::Job& sink, bool judged);
  [[nodiscard]] std::optional<Time> oldest_source(const ChainObservation& output) const;

  const Contract& contract_;
  Judge& judge_;
  std::vector<std::uint32_t> taken_;  // by entry: the stated topic that it takes; kNone: none
  std::vector<std::uint64_t> jobs_;   // by entry: number of the next job
  /// By entry: timestamps of the latest jobs of a source.
  std::map<std::uint32_t, std::deque<std::optional<Time>>> source_jobs_;
  std::vector<ChainObservation> pending_;  // of jobs that have not ended
  std::vector<ObservedChain> observed_;
  imports::ChainFollower follower_;
};

}  // namespace hotpath::watch
