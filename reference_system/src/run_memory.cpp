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
template <class Record>
std::size_t log_bytes(std::uint64_t records) {
  return aligned(RecordLog<Record>::bytes(records));
}

}  // namespace

std::size_t RunMemory::bytes(const Size& size) {
  return counter_bytes(size) + (size.workers + size.executors) * log_bytes<JobRecord>(size.jobs) +
         size.workers * log_bytes<ChainObservation>(size.chains);
}

RunMemory::RunMemory(const Size& size) : descriptor_(memfd_create("hotpath_run", MFD_CLOEXEC)) {
  map(size, true);
}

RunMemory::RunMemory(const Size& size, int descriptor) : descriptor_(descriptor) {
  map(size, false);
  close(std::exchange(descriptor_, -1));
}

void RunMemory::map(const Size& size, bool create) {
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
  next += counter_bytes(size);
  const auto add_logs = [&]<class Record>(std::vector<RecordLog<Record>>& logs, std::uint32_t count,
                                          std::uint64_t records) {
    for (logs.reserve(count); logs.size() < count; next += log_bytes<Record>(records))
      logs.push_back(create ? RecordLog<Record>::create(next, records) : RecordLog<Record>::open(next));
  };
  add_logs(jobs_, size.workers + size.executors, size.jobs);
  add_logs(chains_, size.workers, size.chains);
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
