// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

namespace hotpath::parallel_test {

TEST(ForEachIndex, CallsOnceForEach) {
  for (const unsigned threads : {0U, 1U, 3U}) {
    std::vector<int> calls(1000);
    for_each_index(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    EXPECT_EQ(calls, std::vector<int>(1000, 1)) << threads;
  }
}

TEST(ForEachIndex, BeginsNoCallAfterAFailureAndThrowsTheFirst) {
  for (const unsigned threads : {1U, 3U}) {
    std::atomic<unsigned> calls = 0;
    const auto work = [&](std::size_t i) {
      ++calls;
      if (i >= 5) throw std::runtime_error(std::to_string(i));
    };
    try {
      for_each_index(1'000'000, threads, work);
      ADD_FAILURE();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "5");
    }
    EXPECT_LE(calls, 5 + threads);
  }
}

}  // namespace hotpath::parallel_test
