// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "hotpath/tracing/event.hpp"

namespace hotpath::watch {

struct Unmap {
  void operator()(sensor::Ring* ring) const;
};
/// A ring of a watched program in the memory of this process. The program may change or cut the
/// memory at any time: bytes beyond its end read as zero, instead of a SIGBUS.
using MappedRing = std::unique_ptr<sensor::Ring, Unmap>;

/// Rings that this process maps at a time.
inline constexpr std::size_t kMostRings = 2048;
/// The shared memory object of this name; nullptr: it is not (yet) a ring, belongs to another user, or too
/// many rings are mapped.
[[nodiscard]] MappedRing map_ring(const std::string& name);

/// Keeps the texts of events, each once, for its own lifetime.
class Texts {
 public:
  /// Empty once kMost different texts were kept.
  const char* keep(std::string text) {
    if (const auto kept = texts_.find(text); kept != texts_.end()) return kept->c_str();
    return texts_.size() < kMost ? texts_.insert(std::move(text)).first->c_str() : "";
  }

 private:
  static constexpr std::size_t kMost = 100'000;  // nodes and topics of a system: some thousands
  std::unordered_set<std::string> texts_;
};

/// Reads the records of one ring. Any bytes in it are safe: what is no record is counted as
/// damaged. Descriptions stay in the ring for other readers. The ring must outlive the reader.
class RingReader {
 public:
  explicit RingReader(sensor::Ring& ring);

  /// Appends the events since the last call, in the order in which they were written. `now`: an
  /// event from more than a second later is damaged.
  void read(tracing::Time now, Texts& texts, std::vector<tracing::Event>& events);

  [[nodiscard]] bool describes() const { return describes_; }
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
  const bool describes_;
  const std::uint32_t process_, thread_;
  std::uint64_t tail_ = 0, damaged_ = 0;
};

}  // namespace hotpath::watch
