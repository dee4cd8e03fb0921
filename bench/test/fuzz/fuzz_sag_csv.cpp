// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include "fuzz.hpp"
#include "hotpath/analysis/sag_job.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  return fuzz::read_or_refuse([&] {
    std::istringstream in(std::string(data, data + size));
    std::ostringstream out;
    write_sag_csv(out, read_sag_csv(in, "jobs.csv"));
  });
}
