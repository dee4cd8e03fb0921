// SPDX-License-Identifier: Apache-2.0
#include "import/ctf_reader.hpp"
#include "import/ctf_writer.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

[[noreturn]] void refuse() {
  throw RunError(
      "this hotpath was built without libbabeltrace2, which reads and writes traces; install "
      "libbabeltrace2-dev and build again");
}

}  // namespace

TraceReading read_ctf(const WholePackets&, TraceVisitor&, const std::function<void(double)>&) { refuse(); }
void write_ctf(const std::filesystem::path&, const WrittenTrace&) { refuse(); }

}  // namespace hotpath
