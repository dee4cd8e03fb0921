// SPDX-License-Identifier: Apache-2.0
// Fuzzes the bridge's parameters: the input supplies the dictionary instead of a ROS master.
#include <fuzzer/FuzzedDataProvider.h>

#include <stdexcept>

#include "parameters.hpp"

namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue value(FuzzedDataProvider& input) {
  switch (input.ConsumeIntegralInRange(0, 4)) {
    case 0:
      return input.ConsumeBool();
    case 1:
      return input.ConsumeIntegral<int>();
    case 2:
      return input.ConsumeFloatingPoint<double>();
    case 3:
      return input.ConsumeRandomLengthString(64);
    default:
      break;
  }
  XmlRpcValue list;
  list.setSize(0);
  while (input.ConsumeBool()) list[list.size()] = value(input);
  return list;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  XmlRpcValue given;
  while (input.remaining_bytes() > 0) {
    const char* const name =
        input.PickValueInArray({"domain", "all_interfaces", "points", "clock", "frame", "other"});
    given[name] = value(input);
  }
  std::string unknown;
  try {
    static_cast<void>(hotpath::read_parameters(given, "/left/bridge", unknown));
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
