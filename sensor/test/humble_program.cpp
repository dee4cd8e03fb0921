// SPDX-License-Identifier: Apache-2.0
// Calls each tracepoint of Humble once, and prints how many calls reached the stand-in.
#include <bit>
#include <iostream>

#include "humble_tracetools.hpp"

namespace {

const void* handle(std::uintptr_t address) { return std::bit_cast<const void*>(address); }

}  // namespace

#define HUMBLE_CALL(name, parameters, arguments) ros_trace_##name arguments;

int main() {
  HUMBLE_TRACEPOINTS(HUMBLE_CALL)
  std::cout << stand_in_calls() << "\n";
  return 0;
}
