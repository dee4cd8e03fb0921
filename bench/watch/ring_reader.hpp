// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "hotpath/tracing/event.hpp"

namespace hotpath::watch {

/// Which of the two kinds of rings it is (sensor::kMagic); another value: none, or not yet.
[[nodiscard]] inline std::uint64_t magic_of(sensor::Ring& ring) {
  return std::atomic_ref(ring.magic).load(std::memory_order_acquire);
}

/// Maps rings of watched programs into the memory of this process. A program may change or cut the memory
/// at any time: bytes beyond its end read as zero, instead of a SIGBUS.
class RingMemory {
 public:
  /// That are mapped at a time.
  static constexpr std::size_t kMostRings = 2048;

  /// The shared memory object of this name; nullptr: it is not (yet) a ring, belongs to another user, or too
  /// many rings are mapped.
  [[nodiscard]] static std::unique_ptr<sensor::Ring, RingMemory> map(const std::string& name) {
    [[maybe_unused]] static const bool handled = (handle_cut_memory(), true);
    const auto slot = std::ranges::find_if(mapped, [](const auto& ring) { return ring == 0; });
    const int file = slot == mapped.end() ? -1 : shm_open(name.c_str(), O_RDWR | O_NOFOLLOW, 0);
    if (file < 0) return nullptr;
    void* memory = MAP_FAILED;
    struct stat status {};
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
        status.st_size == sizeof(sensor::Ring))
      memory = mmap(nullptr, sizeof(sensor::Ring), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) return nullptr;
    *slot = reinterpret_cast<std::uintptr_t>(memory);
    std::unique_ptr<sensor::Ring, RingMemory> ring(static_cast<sensor::Ring*>(memory));
    const std::uint64_t magic = magic_of(*ring);
    if (magic != sensor::kMagic && magic != sensor::kDescriptionsMagic) ring.reset();
    return ring;
  }
  /// Unmaps a ring.
  void operator()(sensor::Ring* ring) const {
    const auto at = reinterpret_cast<std::uintptr_t>(ring);
    *std::ranges::find_if(mapped, [&](const auto& other) { return other == at; }) = 0;
    munmap(ring, sizeof *ring);
  }

 private:
  static inline std::array<std::atomic<std::uintptr_t>, kMostRings> mapped;  // read by the signal handler

  static void handle_cut_memory() {
    struct sigaction action {};
    action.sa_sigaction = replace_page;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGBUS, &action, nullptr);
  }
  /// Memory whose file was cut: puts a page of zeros in its place and continues.
  static void replace_page(int, siginfo_t* info, void*) {
    const auto at = reinterpret_cast<std::uintptr_t>(info->si_addr);
    const auto size = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    char* const page = static_cast<char*>(info->si_addr) - at % size;
    for (const std::atomic<std::uintptr_t>& ring : mapped) {
      const std::uintptr_t begin = ring.load(std::memory_order_relaxed);
      if (begin == 0 || at < begin || at >= begin + sizeof(sensor::Ring)) continue;
      void* const replaced =
          mmap(page, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
      if (replaced != MAP_FAILED) return;
    }
    std::signal(SIGBUS, SIG_DFL);  // another cause: the access is repeated and ends the program
  }
};
using MappedRing = std::unique_ptr<sensor::Ring, RingMemory>;

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
  /// What an earlier reader of the same ring has read is not read again, except descriptions.
  explicit RingReader(sensor::Ring& ring)
      : ring_(ring),
        describes_(magic_of(ring) == sensor::kDescriptionsMagic),
        process_(ring.process),
        thread_(ring.thread),
        tail_(describes_ ? 0 : ring.tail.load(std::memory_order_acquire)) {}

  /// Appends the events since the last call, in the order in which they were written. `now`: an
  /// event from more than a second later is damaged.
  void read(tracing::Time now, Texts& texts, std::vector<tracing::Event>& events) {
    const std::uint64_t head = ring_.head.load(std::memory_order_acquire);
    if (head - tail_ > sensor::kCapacity) {
      ++damaged_;
      tail_ = head;
    }
    while (tail_ != head) {
      tracing::Event event;
      const std::uint64_t records = read_group(head - tail_, now, texts, event);
      if (records > 0) {
        events.push_back(event);
      } else {
        ++damaged_;
      }
      tail_ += std::max<std::uint64_t>(records, 1);
    }
    if (!describes_) ring_.tail.store(tail_, std::memory_order_release);
  }

  [[nodiscard]] bool describes() const { return describes_; }
  /// The thread has ended; no event follows those that are in the ring now.
  [[nodiscard]] bool ended() const { return ring_.ended.load(std::memory_order_acquire) != 0; }
  /// Events for which the ring had no room.
  [[nodiscard]] std::uint64_t dropped() const { return ring_.dropped.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }
  [[nodiscard]] std::uint32_t process() const { return process_; }

 private:
  static constexpr std::int16_t kMostProcessors = 8192;  // CONFIG_NR_CPUS of Linux is at most this

  /// The record at a position, copied because the program may change it at any time.
  [[nodiscard]] sensor::Record copy_of(std::uint64_t position) const {
    sensor::Record record;
    std::memcpy(&record, &ring_.records[position % sensor::kCapacity], sizeof record);
    return record;
  }
  /// One event with its texts; returns the number of its records, or 0 if they are damaged.
  std::uint64_t read_group(std::uint64_t available, tracing::Time now, Texts& texts,
                           tracing::Event& event) const {
    const sensor::Record record = copy_of(tail_);
    const tracing::Time at{tracing::Duration(record.at_ns)};
    if (static_cast<std::size_t>(record.kind) >= sensor::kEvents.size() || record.texts >= available ||
        record.at_ns < 0 || at > now + std::chrono::seconds(1))
      return 0;
    const bool known = record.processor >= 0 && record.processor < kMostProcessors;
    event = {record.kind, process_, thread_, known ? record.processor : -1, at};
    std::copy_n(record.number, event.number.size(), event.number.begin());
    std::array<std::string, 2> parts;
    for (std::uint64_t i = 1; i <= record.texts; ++i) {
      const sensor::Record text = copy_of(tail_ + i);
      if (text.kind != sensor::kText || text.length > sensor::kTextBytes || text.which >= parts.size())
        return 0;
      parts[text.which].append(text.text, strnlen(text.text, text.length));
    }
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (!parts[i].empty()) event.text[i] = texts.keep(std::move(parts[i]));
    return 1U + record.texts;
  }

  sensor::Ring& ring_;
  const bool describes_;
  const std::uint32_t process_, thread_;
  std::uint64_t tail_ = 0, damaged_ = 0;
};

}  // namespace hotpath::watch
