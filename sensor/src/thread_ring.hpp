// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>

#include "hotpath/sensor/ring.hpp"

namespace hotpath::sensor {

/// Whether the calling thread has a ring. Its first call creates the ring, if a watcher lives.
bool active();

/// Writes a record into the ring of the calling thread, or counts it as dropped. Without a ring it
/// does nothing. Keeps errno.
void record(EventKind kind, std::initializer_list<std::uint64_t> numbers,
            std::initializer_list<const char*> texts = {});

}  // namespace hotpath::sensor
