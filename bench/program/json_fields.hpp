// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>

namespace hotpath::program {

/// The JSON of a file. Throws nlohmann's exceptions for invalid JSON, std::out_of_range for nesting
/// so deep that a copy would overflow the stack.
[[nodiscard]] inline nlohmann::json parse_shallow(std::istream& in) {
  constexpr int kDeepest = 100;
  bool deep = false;
  nlohmann::json parsed =
      nlohmann::json::parse(in, [&](int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
        deep = deep || depth > kDeepest;
        return depth <= kDeepest;
      });
  if (deep) throw std::out_of_range("it is nested more than 100 deep");
  return parsed;
}

/// The number under `key`. Throws nlohmann's exceptions if it is missing, std::out_of_range unless
/// it is between 0 and `most`.
template <class Number>
[[nodiscard]] Number number_up_to(Number most, const nlohmann::json& j, const char* key) {
  const double value = j.at(key).get<double>();
  if (value >= 0 && value <= static_cast<double>(most)) return j.at(key).get<Number>();
  throw std::out_of_range(std::string("`") + key + "` is " + j.at(key).dump() + ", and must be from 0 to " +
                          nlohmann::json(most).dump());
}

}  // namespace hotpath::program

/// std::nullopt becomes null.
template <class T>
struct nlohmann::adl_serializer<std::optional<T>> {
  static void to_json(json& j, const std::optional<T>& value) { value ? j = *value : j = nullptr; }
  static void from_json(const json& j, std::optional<T>& value) {
    if (j.is_null()) {
      value.reset();
    } else {
      value = j.get<T>();
    }
  }
};
