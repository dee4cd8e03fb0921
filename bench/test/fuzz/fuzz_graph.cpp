// SPDX-License-Identifier: Apache-2.0
#include "fuzz.hpp"
#include "hotpath/reference_system/graph_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static hotpath::fuzz::InputFile file;
  return hotpath::fuzz::read_or_refuse(
      [&] { static_cast<void>(make_tasks(hotpath::load_graph(file.hold(data, size)))); });
}
