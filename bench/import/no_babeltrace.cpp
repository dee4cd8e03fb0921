// SPDX-License-Identifier: Apache-2.0
#include "import/ctf_reader.hpp"
#include "program/errors.hpp"

namespace hotpath {

TraceReading read_ctf(const std::filesystem::path&, TraceVisitor&, const std::function<void(double)>&) {
  throw RunError(
      "this hotpath was built without libbabeltrace2, which reads traces; install libbabeltrace2-dev and "
      "build again");
}

}  // namespace hotpath
