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

/// Where one process of a run records, sized before the run starts and shared with the process that collects:
/// what a process has recorded survives its death. Backed by a memory file without a name, so nothing is left
/// behind anywhere.
class RunMemory {
 public:
  struct Size {
    std::uint32_t tasks = 0;
    std::uint32_t workers = 0;
    std::uint64_t jobs = 0;    ///< Records for each worker, and for what arrivals at an executor overwrite.
    std::uint64_t chains = 0;  ///< Chain observations for each worker.
    std::uint32_t executors = 1;
  };

  /// What that size takes.
  [[nodiscard]] static std::size_t bytes(const Size& size);

  /// Throws std::system_error when there is not enough memory.
  explicit RunMemory(const Size& size);
  /// What another process made with this size, by its memory file, which is closed.
  RunMemory(const Size& size, int descriptor);
  ~RunMemory();
  RunMemory(const RunMemory&) = delete;
  RunMemory& operator=(const RunMemory&) = delete;

  /// The memory file; another program takes it over when it is not closed before (FD_CLOEXEC).
  [[nodiscard]] int descriptor() const { return descriptor_; }

  /// Of each worker, then, of each executor, for what arrivals overwrite.
  [[nodiscard]] const Executor::Logs& jobs() const { return jobs_; }
  [[nodiscard]] const std::vector<RecordLog<ChainObservation>>& chains() const { return chains_; }
  /// Per subscription: samples published for it. Timers: 0.
  [[nodiscard]] std::span<std::atomic<std::uint64_t>> published() const { return published_; }

 private:
  void map(const Size& size, bool create);

  int descriptor_ = -1;
  void* memory_ = nullptr;
  std::size_t bytes_ = 0;
  std::span<std::atomic<std::uint64_t>> published_;
  Executor::Logs jobs_;
  std::vector<RecordLog<ChainObservation>> chains_;
};

/// Samples published for a subscription so far, by all processes of a run.
std::uint64_t published_for(const std::deque<RunMemory>& memories, TaskId subscription);

}  // namespace hotpath
