// SPDX-License-Identifier: Apache-2.0
#include "fuzz.hpp"
#include "import/caret_files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  static const fuzz::TemporaryFolder folder;
  file.hold(data, size);
  static const bool linked = symlink(file.path().c_str(), (folder.path() / "node.yaml").c_str()) == 0;
  if (!linked) std::abort();
  return fuzz::read_or_refuse([&] { static_cast<void>(imports::read_caret_stats(folder.path())); });
}
