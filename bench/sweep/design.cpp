// SPDX-License-Identifier: Apache-2.0
#include "sweep/design.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/analysis/random_stream.hpp"
#include "hotpath/campaign/crew.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

namespace {

constexpr int kDigits = 10;  // of numbers of a range in the cells' commands

std::string number_text(double value) { return program::text("%.*g", kDigits, value); }

}  // namespace

bool names_executor(const std::string& option) {
  return option == "executor" || option == "executors" || option == "deployment" || option == "deployments";
}

bool has_column(const std::string& axis) { return !names_executor(axis) && axis != "seed"; }

bool Axis::values_differ() const {
  const double finest = std::max(std::abs(low), std::abs(high)) * std::pow(10, 1 - kDigits);
  return step > finest && std::isfinite(high - low);
}

std::uint64_t Axis::size() const {
  return step == 0 ? listed.size() : static_cast<std::uint64_t>(std::floor((high - low) / step + 1e-9)) + 1;
}

std::string Axis::value(std::uint64_t i) const {
  return step == 0 ? listed[i] : number_text(low + static_cast<double>(i) * step);
}

std::vector<std::string> Axis::examples() const {
  if (!listed.empty()) return listed;
  if (step == 0) return {number_text(low), number_text(high)};
  return {value(0), value(std::min<std::uint64_t>(1, size() - 1)), value(size() - 1)};
}

std::vector<Option> Design::coordinates(std::uint64_t cell) const {
  const std::uint64_t point = cell / repetitions;
  std::vector<Option> at;
  std::uint64_t rest = point;
  for (std::size_t i = axes.size(); i-- > 0;) {
    const Axis& axis = axes[i];
    std::string value;
    if (random) {
      RandomStream stream(seed, {point, i});
      value = axis.size() == 0 ? number_text(stream.uniform(axis.low, axis.high))
                               : axis.value(stream.below(axis.size()));
    } else {
      value = axis.value(rest % axis.size());
      rest /= axis.size();
    }
    at.push_back({axis.name, value, axis.line});
  }
  std::ranges::reverse(at);
  return at;
}

std::uint64_t Design::seed_of(std::uint64_t cell) const {
  std::string place = std::to_string(seed) + ";";
  std::vector<Option> at = coordinates(cell);
  const auto axis = std::ranges::find(at, "seed", &Option::name);
  if (axis != at.end() && repetition(cell) == 0) return std::stoull(axis->value);
  std::ranges::sort(at, {}, &Option::name);  // the order of axes in the file does not matter
  for (const Option& option : at) {
    if (!names_executor(option.name)) place += option.name + "=" + option.value + ";";
  }
  return hash_of(place + std::to_string(repetition(cell))) >> 11;  // 53 bits, exact in JSON
}

}  // namespace hotpath::sweep
