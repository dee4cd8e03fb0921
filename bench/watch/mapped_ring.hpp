// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/sensor/ring.hpp"

namespace hotpath::watch {

/// A ring of a watched program in the memory of this process. The program may change or cut the
/// memory at any time: bytes beyond its end read as zero, instead of a SIGBUS.
class MappedRing {
 public:
  /// The shared memory object of this name. Without a ring: it is not (yet) one, belongs to
  /// another user, or too many rings are mapped.
  explicit MappedRing(const std::string& name);
  MappedRing(const MappedRing&) = delete;
  MappedRing& operator=(const MappedRing&) = delete;
  ~MappedRing();

  /// nullptr: none.
  [[nodiscard]] sensor::Ring* get() const { return ring_; }

  /// Whether it has descriptions, which stay in it for other readers.
  [[nodiscard]] bool describes() const { return describes_; }

  static constexpr std::size_t kMost = 2048;  ///< Rings that this process maps at a time.

 private:
  sensor::Ring* ring_ = nullptr;
  bool describes_ = false;
};

}  // namespace hotpath::watch
