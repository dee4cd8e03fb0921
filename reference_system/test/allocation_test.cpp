// SPDX-License-Identifier: Apache-2.0
// A job's path through the executor allocates nothing after warm-up.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <thread>
#include <utility>

#include "hotpath/reference_system/graph_file.hpp"
#include "live_fixture.hpp"

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> all_allocations{0}, own_allocations{0};

bool in_this_program(const void* address) {
  static const void* const own_base = [] {
    Dl_info self{};
    dladdr(reinterpret_cast<const void*>(&in_this_program), &self);
    return self.dli_fbase;
  }();
  Dl_info info{};
  return dladdr(address, &info) != 0 && info.dli_fbase == own_base;
}

void* allocate(std::size_t size, const void* caller) {
  if (counting.load(std::memory_order_relaxed)) {
    all_allocations.fetch_add(1, std::memory_order_relaxed);
    if (in_this_program(caller)) own_allocations.fetch_add(1, std::memory_order_relaxed);
  }
  void* memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

// Replaces the allocator of the whole process, including the shared libraries. Not inlined, because
// GCC would warn if it saw only one half of a pair.
[[gnu::noinline]] void* operator new(std::size_t size) { return allocate(size, __builtin_return_address(0)); }
[[gnu::noinline]] void* operator new[](std::size_t size) {
  return allocate(size, __builtin_return_address(0));
}
// Used by std::stable_sort; AddressSanitizer has its own.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size, __builtin_return_address(0));
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace hotpath::allocation_test {
namespace {

struct Counts {
  std::uint64_t all = 0, own = 0, jobs = 0;
};

/// Number of allocations during the second half of a run of 0.7 seconds of a graph without work. The slowest
/// timer, of 500 ms, has a job in each half.
Counts run(const std::string& executor, TransportKind transport, const char* name) {
  Graph graph = load_graph(find_graph(name));
  scale_to_load(graph, 0);
  const GraphTasks tasks = tasks_with(graph, Phases::creation);
  ConnectedSystem connected(graph, tasks, executor, transport);
  LiveSystem& system = connected.system;
  const Time epoch = now() + std::chrono::milliseconds(50);
  system.start(epoch, epoch + std::chrono::milliseconds(700));
  std::this_thread::sleep_until(epoch + std::chrono::milliseconds(300));
  counting = true;
  std::this_thread::sleep_until(epoch + std::chrono::milliseconds(680));
  counting = false;
  system.join();
  system.close(system.join());

  Counts counts{all_allocations.exchange(0), own_allocations.exchange(0)};
  for (const auto& log : connected.memory.jobs()) counts.jobs += log.contents().size();
  return counts;
}

TEST(JobPath, TheCounterSeesAllocations) {
  counting = true;
  ::operator delete(::operator new(1));  // a call that the compiler may not remove
  counting = false;
  EXPECT_GE(own_allocations.exchange(0), 1u);
  all_allocations = 0;
}

class JobPathOf : public testing::TestWithParam<const char*> {};

// The nodes of `callbacks` send messages that identify tasks and have histories of any length (TaskMessage).
TEST_P(JobPathOf, AllocatesNothingInProcessAndNothingOfOursOverFastDds) {
  for (const auto& [graph, least_jobs] : {std::pair("autoware", 101U), std::pair("callbacks", 11U)}) {
    const Counts in_process = run(GetParam(), TransportKind::intra_process, graph);
    EXPECT_GE(in_process.jobs, least_jobs) << graph;
    EXPECT_EQ(in_process.all, 0U) << graph;
    const Counts counts = run(GetParam(), TransportKind::fastdds, graph);
    EXPECT_GE(counts.jobs, least_jobs) << graph;
    EXPECT_EQ(counts.own, 0U) << graph << ", of " << counts.all << " in all, the rest being Fast DDS's own";
  }
}

INSTANTIATE_TEST_SUITE_P(Executors, JobPathOf,
                         testing::Values("default", "static", "multi", "cbg", "events-ro", "rm-ro", "edf-re"),
                         [](const auto& p) {
                           std::string name = p.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace hotpath::allocation_test
