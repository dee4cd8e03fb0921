// SPDX-License-Identifier: Apache-2.0
// Measures the rate at which a coordinator hands out cells that cost nothing. `mpirun -n RANKS
// empty_cells CELLS [MICROSECONDS]`: with MICROSECONDS a cell sleeps instead of working.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <thread>

#include "hotpath/campaign/crew.hpp"

int main(int argc, char** argv) {
  hotpath::Campaign campaign;
  campaign.name = "empty cells";
  campaign.cells.resize(argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000);
  std::iota(campaign.cells.begin(), campaign.cells.end(), 0);
  const std::chrono::microseconds each(argc > 2 ? std::atoi(argv[2]) : 0);
  campaign.work = [each](std::uint64_t) {
    if (each.count() > 0) std::this_thread::sleep_for(each);
    return std::string(200, 'x');
  };
  campaign.gather = [](std::uint64_t, const std::string&) {};
  hotpath::Crew crew({.threads = 1});
  const auto begin = std::chrono::steady_clock::now();
  for (const std::string& note : crew.run(campaign)) std::fprintf(stderr, "%s\n", note.c_str());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (crew.coordinates()) {
    std::printf("%u ranks: %zu cells in %.3f s, %.0f per second\n", crew.ranks(), campaign.cells.size(),
                took.count(), static_cast<double>(campaign.cells.size()) / took.count());
  }
}
