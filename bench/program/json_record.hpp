// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <functional>
#include <istream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

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

/// The visitors below get a constant Record to write and another to read.
template <class T, class Record>
concept MaybeConst = std::same_as<std::remove_const_t<T>, Record>;

/// A type that is stored as a JSON object has one function, which names each member and its key once, for
/// writing (`Json`: nlohmann::json) and for reading (constant) alike:
///   void fields(auto& visit, MaybeConst<Part> auto& part) { visit("name", part.name); }
/// The function stands in the namespace of the type, where argument-dependent lookup finds it. Reading throws
/// nlohmann's exceptions for keys that are missing or of another type, std::out_of_range for numbers and
/// words that are not accepted.
template <class Json>
class JsonFields {
 public:
  explicit JsonFields(Json& object) : object_(object) {}

  template <class Member>
  void operator()(const char* key, Member&& value) {
    using T = std::remove_cvref_t<Member>;
    if constexpr (kWrites && std::is_enum_v<T>) {
      object_[key] = to_string(value);
    } else if constexpr (kWrites) {
      object_[key] = value;
    } else if constexpr (!std::is_lvalue_reference_v<Member>) {
      return;  // computed from members
    } else if constexpr (std::is_enum_v<T>) {
      const auto word = object_.at(key).template get<std::string>();
      const std::optional<T> parsed = parse<T>(word);
      if (!parsed) throw std::out_of_range("`" + std::string(key) + "` is `" + word + "`");
      value = *parsed;
    } else if constexpr (std::unsigned_integral<T> && !std::same_as<T, bool>) {
      value = number_up_to(std::numeric_limits<T>::max(), object_, key);
    } else {
      object_.at(key).get_to(value);
    }
  }
  /// A key that is left out while the member has the value `absent`.
  template <class T>
  void unless(const std::type_identity_t<T>& absent, const char* key, T& value) {
    if (kWrites ? value != absent : present(key)) (*this)(key, value);
  }
  /// A key that is left out where there is no value.
  void if_any(const char* key, auto& value) {
    if constexpr (kWrites) {
      if (value) (*this)(key, *value);
    } else if (present(key)) {
      (*this)(key, value.emplace());
    }
  }
  /// A number from 0 to `most`.
  void up_to(auto most, const char* key, auto& value) {
    number(key, value, most, std::identity(), std::identity());
  }
  void ms(const char* key, MaybeConst<Duration> auto& value, double most_ms = to_ms(kLongest)) {
    number(key, value, most_ms, to_ms, from_ms);
  }
  template <MaybeConst<std::map<std::string, Duration>> Map>
  void ms(const char* key, Map& values) {
    if constexpr (kWrites) object_[key] = nlohmann::json::object();
    JsonFields inner(object_.at(key));
    if constexpr (kWrites) {
      for (const auto& [name, value] : values) inner.ms(name.c_str(), value);
    } else {
      for (const auto& stored : inner.object_.items()) inner.ms(stored.key().c_str(), values[stored.key()]);
    }
  }
  void us(const char* key, auto& value) {
    number(key, value, to_us(kLongest), to_us, [](double us) { return from_ms(us / 1000); });
  }
  void us_if_any(const char* key, auto& value) {
    if constexpr (kWrites) {
      if (value) us(key, *value);
    } else {
      present(key) ? us(key, value.emplace()) : value.reset();
    }
  }
  void ns(const char* key, auto& value) {
    number(key, value, kLongest.count(), std::mem_fn(&Duration::count),
           [](std::int64_t ns) { return Duration(ns); });
  }

 private:
  static constexpr bool kWrites = !std::is_const_v<Json>;

  /// Writes `out` of a member, or reads a number from 0 to `most` whose `in` is the member.
  void number(const char* key, auto& value, auto most, auto out, auto in) {
    if constexpr (kWrites) {
      object_[key] = out(value);
    } else {
      value = in(number_up_to(most, object_, key));
    }
  }
  bool present(const char* key) const {
    const auto stored = object_.find(key);
    return stored != object_.end() && !stored->is_null();
  }

  Json& object_;
};

/// Visits members of `part` whose keys are their names, in a function with arguments `visit` and `part`.
#define HOTPATH_VISIT(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(HOTPATH_VISIT_ONE, __VA_ARGS__))
#define HOTPATH_VISIT_ONE(member) visit(#member, part.member);
/// Defines fields() of a type whose keys are all names of members. End with a semicolon.
#define HOTPATH_FIELDS(Type, ...)                                                                        \
  void fields(auto& visit, hotpath::program::MaybeConst<Type> auto& part) { HOTPATH_VISIT(__VA_ARGS__) } \
  static_assert(true)

/// A type with `fields()`.
template <class T>
concept JsonRecord = requires(JsonFields<nlohmann::json>& writer, const T& value) {
  fields(writer, value);
};

}  // namespace hotpath::program

/// nlohmann's library stores such a type as a JSON object.
template <hotpath::program::JsonRecord T>
struct nlohmann::adl_serializer<T> {
  static void to_json(json& j, const T& value) {
    j = json::object();
    hotpath::program::JsonFields visit(j);
    fields(visit, value);
  }
  static void from_json(const json& j, T& value) {
    hotpath::program::JsonFields visit(j);
    fields(visit, value);
  }
};
