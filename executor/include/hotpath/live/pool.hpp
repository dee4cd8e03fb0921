// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

namespace hotpath {

/// Objects that are lent and come back, each at one address. Callable from any thread.
template <class Object>
class Pool {
 public:
  /// `prepare` is called once for each object, before its first use.
  explicit Pool(std::function<void(Object&)> prepare) : prepare_(std::move(prepare)) {}

  /// Allocates so many more objects.
  void grow(std::uint32_t count) {
    const std::lock_guard lock(mutex_);
    while (count-- > 0) add();
  }
  /// Allocates only if all objects are lent.
  [[nodiscard]] Object& take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) add();
    Object& object = *free_.back();
    free_.pop_back();
    return object;
  }
  void put_back(Object& object) noexcept {
    const std::lock_guard lock(mutex_);
    free_.push_back(&object);  // no allocation: add() reserved the capacity
  }

 private:
  void add() {
    Object& object = all_.emplace_back();
    prepare_(object);
    free_.reserve(all_.size());
    free_.push_back(&object);
  }

  const std::function<void(Object&)> prepare_;
  std::mutex mutex_;
  std::deque<Object> all_;
  std::vector<Object*> free_;
};

}  // namespace hotpath
