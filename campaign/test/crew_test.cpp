// SPDX-License-Identifier: Apache-2.0
#include "hotpath/campaign/crew.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>
#include <semaphore>
#include <stdexcept>
#include <thread>

namespace hotpath::crew_test {

/// Cells whose rows are `row NUMBER`, and what was gathered.
struct Numbers {
  explicit Numbers(std::uint64_t cells) {
    campaign.name = "test";
    campaign.cells.resize(cells);
    std::iota(campaign.cells.begin(), campaign.cells.end(), 0);
    campaign.work = [](std::uint64_t cell) { return "row " + std::to_string(cell); };
    campaign.gather = [this](std::uint64_t cell, const std::string& row) {
      EXPECT_EQ(row, "row " + std::to_string(cell));
      ++gathered[cell];
    };
  }

  Campaign campaign;
  std::map<std::uint64_t, unsigned> gathered;
};

TEST(Crew, GathersEachCellOnce) {
  for (const unsigned threads : {1U, 3U}) {
    Numbers numbers(10'000);
    Crew crew(threads);
    EXPECT_TRUE(crew.coordinates());
    EXPECT_EQ(crew.threads(), threads);
    crew.run(numbers.campaign);
    EXPECT_EQ(numbers.gathered.size(), 10'000U);
    EXPECT_TRUE(std::ranges::all_of(numbers.gathered, [](const auto& one) { return one.second == 1; }));
  }
}

TEST(Crew, HasAThreadPerProcessorAndNothingToDo) {
  Crew crew;
  EXPECT_EQ(crew.threads(), std::max(1U, std::thread::hardware_concurrency()));
  crew.run(Numbers(0).campaign);
}

TEST(Crew, RethrowsWhatACellThrows) {
  Numbers numbers(100);
  std::binary_semaphore gathers(0), failed(0);
  numbers.campaign.work = [&](std::uint64_t cell) -> std::string {
    if (cell == 1) gathers.acquire();
    if (cell == 5) throw std::invalid_argument("cell 5");
    if (cell == 6) failed.release();
    return "row " + std::to_string(cell);
  };
  numbers.campaign.gather = [&](std::uint64_t cell, const std::string&) {
    if (++numbers.gathered[cell]; cell == 0) gathers.release(), failed.acquire();
  };
  EXPECT_THROW(Crew(1).run(numbers.campaign), std::invalid_argument);
  EXPECT_GE(numbers.gathered.size(), 5U) << "rows that were ready before the failure";
}

TEST(Crew, RethrowsWhatGatheringThrows) {
  Numbers numbers(100);
  numbers.campaign.gather = [](std::uint64_t, const std::string&) { throw std::runtime_error("disk full"); };
  EXPECT_THROW(Crew(2).run(numbers.campaign), std::runtime_error);
}

TEST(Crew, StopsWhenAsked) {
  Numbers numbers(1'000'000);
  numbers.campaign.stopped = [&] { return numbers.gathered.size() > 10; };
  Crew(1).run(numbers.campaign);
  EXPECT_LT(numbers.gathered.size(), 1'000'000U);
}

TEST(Hash, IsFnv1a) {
  EXPECT_EQ(hash_of(""), 0xcbf29ce484222325U);
  EXPECT_EQ(hash_of("foobar"), 0x85944171f73967e8U);
  EXPECT_EQ(hash_of("bar", hash_of("foo")), hash_of("foobar"));
  EXPECT_EQ(build_fingerprint(), build_fingerprint());
}

/// One rank of a job that ranks_test.py starts. CELLS, MICROSECONDS and NAME come from the environment;
/// prints each gathered row.
TEST(Rank, DISABLED_SquaresNumbers) {
  const auto number = [](const char* variable) { return std::strtoull(std::getenv(variable), nullptr, 10); };
  Campaign campaign;
  campaign.name = std::getenv("NAME");
  campaign.cells.resize(number("CELLS"));
  std::iota(campaign.cells.begin(), campaign.cells.end(), 0);
  const std::chrono::microseconds each(number("MICROSECONDS"));
  campaign.work = [&](std::uint64_t cell) {
    std::this_thread::sleep_for(each);
    // One row is longer than what MPI sends at once.
    return std::to_string(cell * cell) + std::string(cell == 3 ? 1'000'000 : 0, ' ');
  };
  campaign.gather = [](std::uint64_t cell, const std::string& row) {
    std::printf("%llu %llu\n", static_cast<unsigned long long>(cell),
                std::strtoull(row.c_str(), nullptr, 10));
    std::fflush(stdout);
  };
  Crew crew(2);
  std::printf("rank %s\n", crew.coordinates() ? "0" : "other");
  crew.run(campaign);
}

}  // namespace hotpath::crew_test
