// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace hotpath {

/// A set of jobs, numbered by release. Work-conserving schedules finish jobs nearly in that order;
/// the set therefore stores the length of the unbroken front and a bit for each job after it.
class FinishedJobs {
 public:
  /// All jobs below this one are in the set; this one is not.
  std::uint32_t first_missing() const { return front_; }

  bool contains(std::uint32_t job) const {
    if (job < front_) return true;
    const std::size_t word = job / 64 - front_ / 64;
    return word < later_.size() && ((later_[word] >> (job % 64)) & 1U);
  }

  void insert(std::uint32_t job) {
    const std::size_t word = job / 64 - front_ / 64;
    if (word >= later_.size()) later_.resize(word + 1, 0);
    later_[word] |= std::uint64_t{1} << (job % 64);
    hash_ ^= mix(job);
    std::size_t passed = 0;
    const std::uint32_t first_word = front_ / 64;
    while (front_ / 64 - first_word < later_.size() &&
           ((later_[front_ / 64 - first_word] >> (front_ % 64)) & 1U)) {
      ++front_;
    }
    passed = front_ / 64 - first_word;
    later_.erase(later_.begin(), later_.begin() + static_cast<std::ptrdiff_t>(passed));
  }

  std::uint64_t hash() const { return hash_; }
  std::size_t bytes() const { return later_.capacity() * sizeof(std::uint64_t); }
  friend bool operator==(const FinishedJobs&, const FinishedJobs&) = default;

 private:
  // splitmix64
  static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15U;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31);
  }

  std::uint32_t front_ = 0;
  std::uint64_t hash_ = 0;
  std::vector<std::uint64_t> later_;  // bits from word front_ / 64 on
};

}  // namespace hotpath
