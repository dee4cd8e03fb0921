// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// An instant on which the future of a system may depend.
struct JobInstant {
  enum class Kind : std::uint8_t {
    start,        ///< Of the job.
    end,          ///< Of a job beside others.
    publication,  ///< The job ends and publishes: of interest while its sample is unread or in use.
    release,      ///< Of a timer's job.
    arrival       ///< Of a sample that is on its way: `job` is its subscription and its number.
  };
  JobRef job{};
  Kind kind = Kind::start;
  friend bool operator==(const JobInstant&, const JobInstant&) = default;
};

/// What decides the future of a system in virtual time, as numbers: two states with equal words behave alike,
/// shifted by the difference of their origins. Instants count from the origin; counters that only grow
/// (sequences, activations) never appear.
class StateWords {
 public:
  explicit StateWords(Time origin) : origin_(origin) {}

  void add(std::int64_t word) { words_.push_back(word); }
  void add(Time instant) { words_.push_back(instant == kNever ? -1 : (instant - origin_).count()); }

  /// The state depends on this instant: of a start, it holds data of the job, which has that timestamp.
  /// Returns its place in data().
  std::int64_t add_data(JobInstant instant, Time timestamp) {
    add(std::int64_t{instant.job.task} << 3 | static_cast<std::int64_t>(instant.kind));
    add(timestamp);
    const std::int64_t place = std::ranges::find(data_, instant) - data_.begin();
    if (place == std::ssize(data_)) data_.push_back(instant);
    return place;
  }

  /// The instants given to add_data(), in that order, each once.
  [[nodiscard]] const std::vector<JobInstant>& data() const { return data_; }
  [[nodiscard]] std::vector<std::int64_t> take_words() { return std::move(words_); }

 private:
  const Time origin_;
  std::vector<std::int64_t> words_;
  std::vector<JobInstant> data_;
};

}  // namespace hotpath
