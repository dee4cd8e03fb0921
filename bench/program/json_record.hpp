// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
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
#include "program/json_fields.hpp"

namespace hotpath::program {

/// The visitors below get a constant Record to write and another to read.
template <class T, class Record>
concept MaybeConst = std::same_as<std::remove_const_t<T>, Record>;

/// A type that is stored as a JSON object has one function, which names each member and its key once, for
/// JsonWriter and JsonReader alike:
///   void fields(auto& visit, MaybeConst<Part> auto& part) { visit("name", part.name); }
/// The function stands in the namespace of the type, where argument-dependent lookup finds it.
class JsonWriter {
 public:
  explicit JsonWriter(nlohmann::json& object) : object_(object) {}

  template <class T>
  void operator()(const char* key, const T& value) {
    if constexpr (std::is_enum_v<T>) {
      object_[key] = to_string(value);
    } else {
      object_[key] = value;
    }
  }
  /// A key that is left out while the member has the value `absent`.
  template <class T>
  void unless(const std::type_identity_t<T>& absent, const char* key, const T& value) {
    if (value != absent) (*this)(key, value);
  }
  /// A key that older files do not have.
  template <class T>
  void if_stored(const char* key, const T& value) {
    (*this)(key, value);
  }
  /// A key that is left out where there is no value.
  template <class T>
  void if_any(const char* key, const std::optional<T>& value) {
    if (value) (*this)(key, *value);
  }
  void up_to(double, const char* key, double value) { object_[key] = value; }
  void ms(const char* key, Duration value) { object_[key] = to_ms(value); }
  void ms(const char* key, const std::map<std::string, Duration>& values) {
    nlohmann::json& stored = object_[key] = nlohmann::json::object();
    for (const auto& [name, value] : values) stored[name] = to_ms(value);
  }
  void us(const char* key, Duration value) { object_[key] = to_us(value); }
  void us_if_any(const char* key, const std::optional<Duration>& value) {
    if (value) us(key, *value);
  }
  void ns(const char* key, Duration value) { object_[key] = value.count(); }

 private:
  nlohmann::json& object_;
};

/// The way back. Throws nlohmann's exceptions for keys that are missing or of another type, std::out_of_range
/// for numbers and words that are not accepted.
class JsonReader {
 public:
  explicit JsonReader(const nlohmann::json& object) : object_(object) {}

  template <class T>
  void operator()(const char* key, T& value) {
    const nlohmann::json& stored = object_.at(key);
    if constexpr (std::is_enum_v<T>) {
      const auto word = stored.get<std::string>();
      const std::optional<T> parsed = parse<T>(word);
      if (!parsed) throw std::out_of_range("`" + std::string(key) + "` is `" + word + "`");
      value = *parsed;
    } else if constexpr (std::unsigned_integral<T> && !std::same_as<T, bool>) {
      value = number_up_to(std::numeric_limits<T>::max(), object_, key);
    } else {
      stored.get_to(value);
    }
  }
  template <class T>
  void unless(const std::type_identity_t<T>&, const char* key, T& value) {
    if_stored(key, value);
  }
  template <class T>
  void if_stored(const char* key, T& value) {
    if (present(key)) (*this)(key, value);
  }
  template <class T>
  void if_any(const char* key, std::optional<T>& value) {
    if (present(key)) (*this)(key, value.emplace());
  }
  /// A number from 0 to `most`.
  void up_to(double most, const char* key, double& value) { value = number_up_to(most, object_, key); }
  void ms(const char* key, Duration& value) { value = from_ms(number_up_to(to_ms(kLongest), object_, key)); }
  void ms(const char* key, std::map<std::string, Duration>& values) {
    const nlohmann::json& stored = object_.at(key);
    for (const auto& [name, value] : stored.items()) {
      values[name] = from_ms(number_up_to(to_ms(kLongest), stored, name.c_str()));
    }
  }
  void us(const char* key, Duration& value) {
    value = from_ms(number_up_to(to_us(kLongest), object_, key) / 1000);
  }
  void us_if_any(const char* key, std::optional<Duration>& value) {
    present(key) ? us(key, value.emplace()) : value.reset();
  }
  void ns(const char* key, Duration& value) {
    value = Duration(number_up_to(kLongest.count(), object_, key));
  }

 private:
  bool present(const char* key) const {
    const auto stored = object_.find(key);
    return stored != object_.end() && !stored->is_null();
  }

  const nlohmann::json& object_;
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
concept JsonRecord = requires(JsonWriter& writer, const T& value) {
  fields(writer, value);
};

}  // namespace hotpath::program

/// nlohmann's library stores such a type as a JSON object.
template <hotpath::program::JsonRecord T>
struct nlohmann::adl_serializer<T> {
  static void to_json(json& j, const T& value) {
    j = json::object();
    hotpath::program::JsonWriter writer(j);
    fields(writer, value);
  }
  static void from_json(const json& j, T& value) {
    hotpath::program::JsonReader reader(j);
    fields(reader, value);
  }
};
