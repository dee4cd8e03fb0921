// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hotpath/sensor/event_table.hpp"

/// The shared memory between a watched program (libhotpath_watch.so) and its watcher.
///
/// The watcher chooses a session, 32 hexadecimal digits, and passes it to the program in the
/// environment. It creates the shared memory object `/hotpath_watch.SESSION`, the marker, and locks
/// it exclusively (flock) while it lives. Each thread of the program that calls a tracepoint creates
/// an object `/hotpath_watch.SESSION.RANDOM` (16 hexadecimal digits) with mode 0600, which holds one
/// Ring. The watcher maps it and removes its name.
///
/// A program that is started on its own has the session kAttachable. Its objects are called
/// `/hotpath_watch.attachable.PROCESS.RANDOM`, and keep their names while the process lives. Besides
/// its ring, a thread has a second one for descriptions (kDescriptionsMagic) if it calls such
/// tracepoints: nobody advances its tail, so that each watcher reads all of them. A watcher that
/// attaches locks `/hotpath_watch.attached.USER`.
///
/// The thread alone writes `head`, `dropped` and records, the watcher alone writes `tail`. Neither
/// trusts the other: both mask positions before they use them.
namespace hotpath::sensor {

inline constexpr const char* kSessionVariable = "HOTPATH_WATCH";
inline constexpr const char* kNamePrefix = "/hotpath_watch.";
inline constexpr const char* kAttachable = "attachable";
inline constexpr const char* kAttachedPrefix = "/hotpath_watch.attached.";
inline constexpr std::size_t kSessionDigits = 32, kRandomDigits = 16;

/// Identifies a ring, the version of its layout ("HPWATCH3"), and the table of events that both sides
/// have: its hash (FNV-1a).
inline constexpr std::uint64_t kMagic = [] {
  std::uint64_t hash = 0x33484354'41575048;
  const auto add = [&](std::string_view text, FieldType type) {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    hash = (hash ^ static_cast<unsigned>(type)) * 0x100000001b3;
  };
  for (const EventFormat& event : kEvents) {
    add(event.name, {});
    for (const EventField& field : event.fields()) add(field.name, field.type);
  }
  return hash;
}();
inline constexpr std::uint64_t kDescriptionsMagic = ~kMagic;

/// Not an event: continues the record before it.
inline constexpr EventKind kText{255};

inline constexpr std::size_t kTextBytes = 48;   ///< Of a record.
inline constexpr std::size_t kTextRecords = 6;  ///< Most records of one text; longer texts are cut.

/// One cache line.
struct alignas(64) Record {
  std::int64_t at_ns;      ///< CLOCK_MONOTONIC.
  EventKind kind;          ///< Or kText.
  std::uint8_t texts;      ///< Tracepoints: text records that follow.
  std::uint8_t length;     ///< Text records: bytes in use, 0 to kTextBytes.
  std::uint16_t which;     ///< Text records: 0 for the first text of the tracepoint, 1 for the second.
  std::int16_t processor;  ///< -1: unknown.
  union {
    std::uint64_t number[4];  ///< Tracepoints: handles and numbers, in the order of the table.
    char text[kTextBytes];    ///< Text records: without a terminator.
  };
};
static_assert(sizeof(Record) == 64);

inline constexpr std::uint64_t kCapacity = 8192;  ///< Records of a ring; a power of two.

struct Ring {
  std::uint64_t magic;
  std::uint32_t process, thread;     ///< Ids.
  std::atomic<std::uint32_t> ended;  ///< 1: the thread writes no more.
  /// Records written since the beginning. A tracepoint and its texts appear together.
  alignas(64) std::atomic<std::uint64_t> head;
  /// Tracepoints for which there was no room, also those of threads of the process that got no ring.
  std::atomic<std::uint64_t> dropped;
  /// Records that the watcher has read.
  alignas(64) std::atomic<std::uint64_t> tail;
  Record records[kCapacity];
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

}  // namespace hotpath::sensor
