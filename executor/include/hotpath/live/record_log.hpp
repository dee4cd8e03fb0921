// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

namespace hotpath {

/// A log of fixed capacity in memory that the caller provides, which may be shared with another process: what
/// was appended can be read there even when the writer dies. One writer at a time; append() neither allocates
/// nor blocks.
template <class Record>
class RecordLog {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  static constexpr std::size_t bytes(std::uint64_t capacity) {
    return sizeof(Header) + static_cast<std::size_t>(capacity) * sizeof(Record);
  }

  RecordLog() = default;

  /// An empty log in `memory`, which is aligned like std::max_align_t and holds bytes(capacity).
  static RecordLog create(void* memory, std::uint64_t capacity) {
    RecordLog log;
    log.header_ = new (memory) Header{};
    log.header_->capacity = capacity;
    return log;
  }

  /// The log that create() made in this memory.
  static RecordLog open(void* memory) {
    RecordLog log;
    log.header_ = static_cast<Header*>(memory);
    return log;
  }

  /// Counts the record as lost when the log is full.
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
