// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/run_memory.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

#include "hotpath/reference_system/run_channel.hpp"

namespace hotpath {

namespace {

static_assert(sizeof(JobRecord) == 96 && sizeof(ChainObservation) == 120 && sizeof(ChannelMessage) == 1064,
              "raise kRunLayout");

constexpr std::size_t kAlignment = 64;
constexpr std::size_t aligned(std::size_t n) { return (n + kAlignment - 1) / kAlignment * kAlignment; }

std::size_t counter_bytes(const RunMemory::Size& size) {
  return aligned((size.tasks + 1) * sizeof(std::atomic<std::uint64_t>));
}
std::size_t job_log_bytes(const RunMemory::Size& size) {
  return aligned(RecordLog<JobRecord>::bytes(size.jobs));
}
std::size_t chain_log_bytes(const RunMemory::Size& size) {
  return aligned(RecordLog<ChainObservation>::bytes(size.chains));
}

}  // namespace

std::size_t RunMemory::bytes(const Size& size) {
  return counter_bytes(size) + (size.workers + size.executors) * job_log_bytes(size) +
         size.workers * chain_log_bytes(size);
}

RunMemory::RunMemory(const Size& size) : descriptor_(memfd_create("hotpath_run", MFD_CLOEXEC)) {
  map(size, true);
}

RunMemory::RunMemory(const Size& size, int descriptor) : descriptor_(descriptor) {
  map(size, false);
  close(std::exchange(descriptor_, -1));
}

void RunMemory::map(const Size& size, bool create) {
  const std::size_t counters = counter_bytes(size), job_log = job_log_bytes(size);
  const std::size_t chain_log = chain_log_bytes(size);
  bytes_ = bytes(size);

  // Shared with processes forked later. Populated now, to avoid page faults on the job path.
  const bool sized = descriptor_ >= 0 && (!create || ftruncate(descriptor_, static_cast<off_t>(bytes_)) == 0);
  memory_ = sized ? mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, descriptor_, 0)
                  : MAP_FAILED;
  if (memory_ == MAP_FAILED) {
    throw std::system_error(
        errno, std::generic_category(),
        "no memory for the trace buffers (" + std::to_string(bytes_ >> 20) + " MiB); shorten the run");
  }
  char* next = static_cast<char*>(memory_);
  auto* counter = reinterpret_cast<std::atomic<std::uint64_t>*>(next);
  for (std::size_t i = 0; create && i <= size.tasks; ++i) new (counter + i) std::atomic<std::uint64_t>(0);
  published_ = {counter, size.tasks};
  rejected_ = counter + size.tasks;
  next += counters;
  for (std::uint32_t i = 0; i < size.workers + size.executors; ++i, next += job_log) {
    using Log = RecordLog<JobRecord>;
    jobs_.push_back(create ? Log::create(next, size.jobs) : Log::open(next));
  }
  for (std::uint32_t i = 0; i < size.workers; ++i, next += chain_log) {
    using Log = RecordLog<ChainObservation>;
    chains_.push_back(create ? Log::create(next, size.chains) : Log::open(next));
  }
}

RunMemory::~RunMemory() {
  munmap(memory_, bytes_);
  if (descriptor_ >= 0) close(descriptor_);
}

std::uint64_t published_for(const std::deque<RunMemory>& memories, TaskId subscription) {
  std::uint64_t published = 0;
  for (const RunMemory& memory : memories) published += memory.published()[subscription].load();
  return published;
}

}  // namespace hotpath
