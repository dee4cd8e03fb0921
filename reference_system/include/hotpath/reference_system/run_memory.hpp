// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "hotpath/live/executor.hpp"
#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

/// The memory into which one process of a run records. It is sized before the run starts and shared
/// with the collecting process, so records survive the death of the recording process. Backed by an
/// unnamed memory file, so nothing is left behind.
class RunMemory {
 public:
  struct Size {
    std::uint32_t tasks = 0;
    std::uint32_t workers = 0;
    std::uint64_t jobs = 0;    ///< Records per worker, and per executor for samples overwritten at arrival.
    std::uint64_t chains = 0;  ///< Chain observations per worker.
    std::uint32_t executors = 1;
  };

  /// Number of bytes for this size.
  [[nodiscard]] static std::size_t bytes(const Size& size);

  /// Throws std::system_error if there is not enough memory.
  explicit RunMemory(const Size& size);
  /// Maps the memory that another process created with this size, by the descriptor of its memory
  /// file, which is then closed.
  RunMemory(const Size& size, int descriptor);
  ~RunMemory();
  RunMemory(const RunMemory&) = delete;
  RunMemory& operator=(const RunMemory&) = delete;

  /// The memory file; another program can take it over unless FD_CLOEXEC closes it before.
  [[nodiscard]] int descriptor() const { return descriptor_; }

  /// One log per worker, then one per executor for samples overwritten at arrival.
  [[nodiscard]] const Executor::Logs& jobs() const { return jobs_; }
  [[nodiscard]] const std::vector<RecordLog<ChainObservation>>& chains() const { return chains_; }
  /// Per subscription: samples published for it. Timers: 0.
  [[nodiscard]] std::span<std::atomic<std::uint64_t>> published() const { return published_; }
  /// Samples of other programs on the topics of the run.
  [[nodiscard]] std::atomic<std::uint64_t>& rejected() const { return *rejected_; }

 private:
  void map(const Size& size, bool create);

  int descriptor_ = -1;
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
  std::span<std::atomic<std::uint64_t>> published_;
  std::atomic<std::uint64_t>* rejected_ = nullptr;
  Executor::Logs jobs_;
  std::vector<RecordLog<ChainObservation>> chains_;
};

/// Number of samples published so far for a subscription, by all processes of a run.
std::uint64_t published_for(const std::deque<RunMemory>& memories, TaskId subscription);

}  // namespace hotpath
