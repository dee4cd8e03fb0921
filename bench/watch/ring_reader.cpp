// SPDX-License-Identifier: Apache-2.0
#include "watch/ring_reader.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstring>

namespace hotpath::watch {

namespace {

using sensor::Record;

/// The mapped rings; read by the signal handler.
std::array<std::atomic<std::uintptr_t>, kMostRings> mapped;

/// Memory whose file was cut: puts a page of zeros in its place and continues.
void replace_page(int, siginfo_t* info, void*) {
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

void handle_cut_memory() {
  struct sigaction action {};
  action.sa_sigaction = replace_page;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGBUS, &action, nullptr);
}

std::uint64_t magic_of(sensor::Ring& ring) {
  return std::atomic_ref(ring.magic).load(std::memory_order_acquire);
}

bool is_ring(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
         status.st_size == sizeof(sensor::Ring);
}

constexpr std::int16_t kMostProcessors = 8192;  // CONFIG_NR_CPUS of Linux is at most this

/// The record at a position, copied because the program may change it at any time.
Record copy_of(const sensor::Ring& ring, std::uint64_t position) {
  Record record;
  std::memcpy(&record, &ring.records[position % sensor::kCapacity], sizeof record);
  return record;
}

}  // namespace

MappedRing map_ring(const std::string& name) {
  [[maybe_unused]] static const bool handled = (handle_cut_memory(), true);
  const auto slot = std::ranges::find_if(mapped, [](const auto& ring) { return ring == 0; });
  const int file = slot == mapped.end() ? -1 : shm_open(name.c_str(), O_RDWR | O_NOFOLLOW, 0);
  if (file < 0) return nullptr;
  void* memory = MAP_FAILED;
  if (is_ring(file))
    memory = mmap(nullptr, sizeof(sensor::Ring), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) return nullptr;
  *slot = reinterpret_cast<std::uintptr_t>(memory);
  MappedRing ring(static_cast<sensor::Ring*>(memory));
  const std::uint64_t magic = magic_of(*ring);
  if (magic != sensor::kMagic && magic != sensor::kDescriptionsMagic) ring.reset();
  return ring;
}

void Unmap::operator()(sensor::Ring* ring) const {
  const auto at = reinterpret_cast<std::uintptr_t>(ring);
  *std::ranges::find_if(mapped, [&](const auto& other) { return other == at; }) = 0;
  munmap(ring, sizeof *ring);
}

// What an earlier reader of the same ring has read is not read again.
RingReader::RingReader(sensor::Ring& ring)
    : ring_(ring),
      describes_(magic_of(ring) == sensor::kDescriptionsMagic),
      process_(ring.process),
      thread_(ring.thread),
      tail_(describes_ ? 0 : ring.tail.load(std::memory_order_acquire)) {}

void RingReader::read(tracing::Time now, Texts& texts, std::vector<tracing::Event>& events) {
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

std::uint64_t RingReader::read_group(std::uint64_t available, tracing::Time now, Texts& texts,
                                     tracing::Event& event) const {
  const Record record = copy_of(ring_, tail_);
  const tracing::Time at{tracing::Duration(record.at_ns)};
  if (static_cast<std::size_t>(record.kind) >= sensor::kEvents.size() || record.texts >= available ||
      record.at_ns < 0 || at > now + std::chrono::seconds(1))
    return 0;
  event.kind = record.kind;
  event.process = process_;
  event.thread = thread_;
  event.processor = record.processor < 0 || record.processor >= kMostProcessors ? -1 : record.processor;
  event.at = at;
  std::copy_n(record.number, event.number.size(), event.number.begin());
  std::array<std::string, 2> parts;
  for (std::uint64_t i = 1; i <= record.texts; ++i) {
    const Record text = copy_of(ring_, tail_ + i);
    if (text.kind != sensor::kText || text.length > sensor::kTextBytes || text.which >= parts.size())
      return 0;
    parts[text.which].append(text.text, strnlen(text.text, text.length));
  }
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (!parts[i].empty()) event.text[i] = texts.keep(std::move(parts[i]));
  return 1U + record.texts;
}

}  // namespace hotpath::watch
