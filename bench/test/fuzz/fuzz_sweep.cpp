// SPDX-License-Identifier: Apache-2.0
#include "fuzz.hpp"
#include "sweep/design.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  return fuzz::read_or_refuse([&] {
    const sweep::Design design = sweep::load_sweep(file.hold(data, size));
    for (const std::uint64_t cell : {std::uint64_t{0}, design.cells() / 2, design.cells() - 1})
      static_cast<void>(design.seed_of(cell));
  });
}
