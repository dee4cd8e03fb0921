// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// What decides the future of a system in virtual time, as numbers: two states with equal words behave alike,
/// shifted by the difference of their origins. Instants count from the origin; counters that only grow
/// (sequences, activations) never appear.
class StateWords {
 public:
  explicit StateWords(Time origin) : origin_(origin) {}

  void add(std::int64_t word) { words_.push_back(word); }
  void add(Time instant) { words_.push_back(instant == kNever ? -1 : (instant - origin_).count()); }

  /// The state holds data of this job, which began at that timestamp.
  void add_data(JobRef job, Time timestamp) {
    add(job.task);
    add(timestamp);
    if (std::find(data_.begin(), data_.end(), job) == data_.end()) data_.push_back(job);
  }

  [[nodiscard]] const std::vector<std::int64_t>& words() const { return words_; }
  /// The jobs given to add_data(), in that order, each once.
  [[nodiscard]] const std::vector<JobRef>& data() const { return data_; }
  [[nodiscard]] std::vector<std::int64_t> take_words() { return std::move(words_); }

 private:
  const Time origin_;
  std::vector<std::int64_t> words_;
  std::vector<JobRef> data_;
};

}  // namespace hotpath
