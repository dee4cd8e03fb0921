// SPDX-License-Identifier: Apache-2.0
#include "cell_pool.hpp"

#include <utility>

namespace hotpath {

CellPool::CellPool(unsigned threads, std::function<std::string(std::uint64_t)> work)
    : work_(std::move(work)) {
  while (threads_.size() < threads) {
    threads_.emplace_back([this](const std::stop_token& stop) { work_until(stop); });
  }
}

void CellPool::add(std::span<const std::uint64_t> cells) {
  {
    const std::lock_guard lock(mutex_);
    queue_.insert(queue_.end(), cells.begin(), cells.end());
  }
  added_.notify_all();
}

std::size_t CellPool::waiting() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

std::vector<CellResult> CellPool::take(std::chrono::microseconds most) {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, most, [this] { return !results_.empty(); });
  return std::exchange(results_, {});
}

std::exception_ptr CellPool::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void CellPool::work_until(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (added_.wait(lock, stop, [this] { return !queue_.empty(); }) && !stop.stop_requested()) {
    CellResult result{queue_.front(), {}, {}};
    queue_.pop_front();
    lock.unlock();
    std::exception_ptr thrown;
    try {
      result.row = work_(result.cell);
    } catch (const std::exception& error) {
      thrown = std::current_exception();
      result.failure = error.what();
    }
    lock.lock();
    if (thrown && !failure_) failure_ = thrown;
    results_.push_back(std::move(result));
    done_.notify_one();
  }
}

}  // namespace hotpath
