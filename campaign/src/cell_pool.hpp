// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "message.hpp"

namespace hotpath {

/// Threads that compute the cells of a queue. The destructor waits for the cells that have begun.
class CellPool {
 public:
  CellPool(unsigned threads, std::function<std::string(std::uint64_t)> work);

  void add(std::span<const std::uint64_t> cells);
  /// Number of cells that no thread has begun.
  [[nodiscard]] std::size_t waiting() const;
  /// Takes all available results; if there are none, waits for the first one, at most `most`.
  std::vector<CellResult> take(std::chrono::microseconds most);
  /// The exception of the first failed cell; nullptr if none failed.
  [[nodiscard]] std::exception_ptr failure() const;

 private:
  void work_until(const std::stop_token& stop);

  const std::function<std::string(std::uint64_t)> work_;
  mutable std::mutex mutex_;
  std::condition_variable_any added_, done_;
  std::deque<std::uint64_t> queue_;
  std::vector<CellResult> results_;
  std::exception_ptr failure_;
  std::vector<std::jthread> threads_;  // last: the threads use all other members
};

}  // namespace hotpath
