// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "fuzz.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_keys.hpp"

/// Gives libFuzzer the keys of graph files as its dictionary.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  static hotpath::fuzz::InputFile file;
  std::string words;
  for (const std::string& key : hotpath::key_names(~0U)) words += '"' + key + ": \"\n";
  static std::string option =
      "-dict=" + file.hold(reinterpret_cast<const std::uint8_t*>(words.data()), words.size());
  static std::vector<char*> arguments(*argv, *argv + *argc);
  arguments.push_back(option.data());
  arguments.push_back(nullptr);
  *argv = arguments.data();
  ++*argc;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static hotpath::fuzz::InputFile file;
  return hotpath::fuzz::read_or_refuse(
      [&] { static_cast<void>(make_tasks(hotpath::load_graph(file.hold(data, size)))); });
}
