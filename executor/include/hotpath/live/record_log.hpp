// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

namespace hotpath {

/// A log of fixed capacity in memory provided by the caller. The memory may be shared with another
/// process, which can read the appended records even after the writer has died. One writer at a
/// time; append() neither allocates nor blocks.
template <class Record>
class RecordLog {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  static constexpr std::size_t bytes(std::uint64_t capacity) {
    return sizeof(Header) + static_cast<std::size_t>(capacity) * sizeof(Record);
  }

  RecordLog() = default;

  /// Creates an empty log in `memory`, which must be aligned like std::max_align_t and hold
  /// bytes(capacity).
  static RecordLog create(void* memory, std::uint64_t capacity) {
    RecordLog log;
    log.header_ = new (memory) Header{};
    log.header_->capacity = capacity;
    return log;
  }

  /// Opens the log that create() placed in this memory.
  static RecordLog open(void* memory) {
    RecordLog log;
    log.header_ = static_cast<Header*>(memory);
    return log;
  }

  /// Appends a record; if the log is full, counts the record as lost.
  void append(const Record& record) {
    const std::uint64_t n = header_->count.load(std::memory_order_relaxed);
    if (n == header_->capacity) {
      header_->lost.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    new (records() + n) Record(record);
    header_->count.store(n + 1, std::memory_order_release);
  }

  [[nodiscard]] std::span<const Record> contents() const {
    return {records(), static_cast<std::size_t>(header_->count.load(std::memory_order_acquire))};
  }
  [[nodiscard]] std::uint64_t lost() const { return header_->lost.load(std::memory_order_relaxed); }

 private:
  struct alignas(64) Header {
    std::atomic<std::uint64_t> count{0};
    std::atomic<std::uint64_t> lost{0};
    std::uint64_t capacity = 0;
  };
  [[nodiscard]] Record* records() const { return reinterpret_cast<Record*>(header_ + 1); }

  Header* header_ = nullptr;
};

}  // namespace hotpath
