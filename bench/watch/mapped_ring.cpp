// SPDX-License-Identifier: Apache-2.0
#include "watch/mapped_ring.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>

namespace hotpath::watch {

namespace {

/// The mapped rings; read by the signal handler.
std::array<std::atomic<std::uintptr_t>, MappedRing::kMost> mapped;

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

bool is_ring(int file) {
  struct stat status {};
  return fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
         status.st_size == sizeof(sensor::Ring);
}

}  // namespace

MappedRing::MappedRing(const std::string& name) {
  [[maybe_unused]] static const bool handled = (handle_cut_memory(), true);
  const auto slot = std::ranges::find_if(mapped, [](const auto& ring) { return ring == 0; });
  if (slot == mapped.end()) return;
  const int file = shm_open(name.c_str(), O_RDWR | O_NOFOLLOW, 0);
  if (file < 0) return;
  void* memory = MAP_FAILED;
  if (is_ring(file))
    memory = mmap(nullptr, sizeof(sensor::Ring), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) return;
  *slot = reinterpret_cast<std::uintptr_t>(memory);
  ring_ = static_cast<sensor::Ring*>(memory);
  const std::uint64_t magic = std::atomic_ref(ring_->magic).load(std::memory_order_acquire);
  describes_ = magic == sensor::kDescriptionsMagic;
  if (magic == sensor::kMagic || describes_) return;
  *slot = 0;
  munmap(memory, sizeof(sensor::Ring));
  ring_ = nullptr;
}

MappedRing::~MappedRing() {
  if (ring_ == nullptr) return;
  std::ranges::find(mapped, reinterpret_cast<std::uintptr_t>(ring_), [](const auto& ring) {
    return ring.load();
  })->store(0);
  munmap(ring_, sizeof(sensor::Ring));
}

}  // namespace hotpath::watch
