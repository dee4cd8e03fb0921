// SPDX-License-Identifier: Apache-2.0
#include "fuzz.hpp"
#include "results/schedule.hpp"
#include "results/stored_run.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  return fuzz::read_or_refuse([&] {
    const std::string& path = file.hold(data, size);
    static_cast<void>(results::summarize_golden_trace(path));
    static_cast<void>(results::schedule_of(read_golden_trace(path), true));
  });
}
