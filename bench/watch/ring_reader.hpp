// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "hotpath/tracing/event.hpp"
#include "watch/texts.hpp"

namespace hotpath::watch {

/// The kind of event that a tracepoint becomes; `id` is not Id::text.
[[nodiscard]] tracing::EventKind kind_of(sensor::Id id);

/// Reads the records of one ring. Any bytes in it are safe: what is no record is counted as
/// damaged. The ring must outlive the reader.
class RingReader {
 public:
  /// `keeps`: leave the records in the ring for other readers.
  explicit RingReader(sensor::Ring& ring, bool keeps = false);

  /// Appends the events since the last call, in the order in which they were written. `now`: an
  /// event from more than a second later is damaged.
  void read(tracing::Time now, Texts& texts, std::vector<tracing::Event>& events);

  /// The thread has ended; no event follows those that are in the ring now.
  [[nodiscard]] bool ended() const { return ring_.ended.load(std::memory_order_acquire) != 0; }
  /// Events for which the ring had no room.
  [[nodiscard]] std::uint64_t dropped() const { return ring_.dropped.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }
  [[nodiscard]] std::uint32_t process() const { return process_; }

 private:
  /// One event with its texts; returns the number of its records, or 0 if they are damaged.
  std::uint64_t read_group(std::uint64_t available, tracing::Time now, Texts& texts,
                           tracing::Event& event) const;

  sensor::Ring& ring_;
  const bool keeps_;
  const std::uint32_t process_, thread_;
  std::uint64_t tail_ = 0, damaged_ = 0;
};

}  // namespace hotpath::watch
