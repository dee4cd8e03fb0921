// SPDX-License-Identifier: Apache-2.0
#include "hotpath/tracing/ctf_trace.hpp"

namespace hotpath::tracing {

namespace {

[[noreturn]] void refuse() {
  throw std::runtime_error(
      "this hotpath was built without libbabeltrace2, which reads and writes traces; install "
      "libbabeltrace2-dev and build again");
}

}  // namespace

TraceReading CtfTrace::read(const std::function<void(const Event&)>&) const { refuse(); }
void write_ctf(const std::filesystem::path&, std::span<const Event>, const std::string&) { refuse(); }

}  // namespace hotpath::tracing
