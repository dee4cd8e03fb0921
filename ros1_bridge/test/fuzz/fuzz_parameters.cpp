// SPDX-License-Identifier: Apache-2.0
// Fuzzes the bridge's parameters: the input supplies the values instead of a ROS master.
#include <fuzzer/FuzzedDataProvider.h>

#include <optional>

#include "parameters.hpp"

namespace hotpath {

/// Supplies values until the input is used up.
struct RosNode::Impl {
  FuzzedDataProvider input;
};

RosNode::RosNode(int& size, char** data, const std::string&)
    : impl_(new Impl{{reinterpret_cast<const std::uint8_t*>(*data), static_cast<std::size_t>(size)}}) {}
RosNode::~RosNode() = default;
std::string RosNode::name() const { return "/left/bridge"; }
std::string RosNode::name_space() const { return "/left"; }

namespace {

template <class Value>
std::optional<Value> maybe(FuzzedDataProvider& input, Value (*value)(FuzzedDataProvider&)) {
  return input.ConsumeBool() ? std::optional(value(input)) : std::nullopt;
}
std::string text(FuzzedDataProvider& input) { return input.ConsumeRandomLengthString(64); }
std::vector<std::string> texts(FuzzedDataProvider& input) {
  std::vector<std::string> all;
  while (input.ConsumeBool()) all.push_back(text(input));
  return all;
}

}  // namespace

std::optional<bool> RosNode::boolean(const std::string&) const {
  return maybe<bool>(impl_->input, [](FuzzedDataProvider& input) { return input.ConsumeBool(); });
}
std::optional<double> RosNode::number(const std::string&) const {
  return maybe<double>(impl_->input,
                       [](FuzzedDataProvider& input) { return input.ConsumeFloatingPoint<double>(); });
}
std::optional<std::int64_t> RosNode::integer(const std::string&) const {
  return maybe<std::int64_t>(impl_->input,
                             [](FuzzedDataProvider& input) { return input.ConsumeIntegral<std::int64_t>(); });
}
std::optional<std::string> RosNode::string(const std::string&) const { return maybe(impl_->input, text); }
std::optional<std::vector<std::string>> RosNode::strings(const std::string&) const {
  return maybe(impl_->input, texts);
}
std::vector<std::string> RosNode::parameters() const { return texts(impl_->input); }
void RosNode::log(Severity, const std::string&) {}

}  // namespace hotpath

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string bytes(data, data + size);
  char* begin = bytes.data();
  int count = static_cast<int>(size);
  try {
    static_cast<void>(hotpath::read_parameters(hotpath::RosNode(count, &begin, "")));
  } catch (const hotpath::ParameterError&) {
  }
  return 0;
}
