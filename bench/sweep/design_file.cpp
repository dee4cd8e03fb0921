// SPDX-License-Identifier: Apache-2.0
#include "sweep/design.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

namespace {

constexpr const char* kRemedy = "a sweep is one YAML map with `command` and `axes`; see docs/sweeps.md";

/// Options of a command that the sweep sets itself.
const std::vector<std::string> kOwnOptions = {"output", "threads", "help", "csv", "page", "quick"};

double number(const YamlValue& value) {
  try {
    std::size_t end = 0;
    const std::string given = value.text();
    const double parsed = std::stod(given, &end);
    if (end == given.size() && std::isfinite(parsed)) return parsed;
  } catch (const std::logic_error&) {  // not a number
  }
  value.fail("`" + value.text() + "` is not a number", "give a number");
}

/// {from, to, step}, or {from, to} for a random design.
void parse_range(const YamlValue& value, bool random, Axis& axis) {
  const YamlMap range(value, "axis " + axis.name);
  range.check_keys({"from", "to", "step"});
  axis.low = number(range.require("from", "NUMBER"));
  axis.high = number(range.require("to", "NUMBER"));
  if (axis.low > axis.high) range.fail("axis " + axis.name + " goes from high to low", "swap the ends");
  const auto step = range.find("step");
  if (!step && random) return;
  if (!step) range.fail("axis " + axis.name + " has no step", "add `step: NUMBER`, or `design: {random: N}`");
  axis.step = number(*step);
  if (!axis.values_differ()) step->fail("this step is too small for a grid", "give a larger one");
}

/// A value, or a list of values that a cell uses together.
std::string option_text(const YamlValue& value, const std::string& item_name) {
  if (!value.is_list()) return value.text();
  std::vector<std::string> words;
  for (const YamlValue& item : value.list(item_name)) words.push_back(item.text());
  return program::joined(words, ",");
}

void check_own(const YamlMap& map, const std::string& name, int line, const std::string& file) {
  if (std::ranges::count(kOwnOptions, name) == 0) return;
  throw InputError(file, line, map.what() + " has `" + name + "`, which the sweep sets itself",
                   "leave it out");
}

class Parser {
 public:
  explicit Parser(const std::string& file) {
    design_.file = file;
    design_.text = read_text_file(file);
  }

  Design parse() {
    const YAML::Node root = read_yaml(design_.file, design_.text, kRemedy);
    const YamlMap map(YamlValue(design_.file, root, "the sweep", 1), "the sweep");
    map.check_keys({"command", "fixed", "axes", "design", "repetitions", "seed", "keep"});
    const std::vector<std::string> commands = {"simulate", "run", "analyze"};
    design_.command = commands[map.require("command", "simulate").choice(commands)];
    constexpr std::int64_t kMost = std::int64_t{1} << 53;  // exact in JSON
    if (const auto seed = map.find("seed"))
      design_.seed = static_cast<std::uint64_t>(seed->integer(0, kMost));
    if (const auto n = map.find("repetitions"))
      design_.repetitions = static_cast<std::uint32_t>(n->integer(1, 10'000));
    parse_design(map);
    if (const auto fixed = map.find("fixed")) parse_fixed(*fixed);
    parse_axes(map.require("axes", "{load: {from: 20, to: 90, step: 10}}"));
    if (const auto keep = map.find("keep")) parse_keep(*keep);
    return std::move(design_);
  }

 private:
  void parse_design(const YamlMap& map) {
    const auto design = map.find("design");
    if (!design || (design->is_text() && design->text() == "grid")) return;
    const YamlMap random(*design, "the design");
    random.check_keys({"random"});
    design_.random = true;
    design_.points = static_cast<std::uint64_t>(
        random.require("random", "N").integer(1, static_cast<std::int64_t>(kMostCells)));
  }

  void parse_fixed(const YamlValue& value) {
    const YamlMap map(value, "fixed");
    for (const std::string& key : map.keys()) {
      const YamlValue given = *map.find(key);
      check_own(map, key, given.line(), design_.file);
      if (key == "seed" || key == "repetitions") {
        given.fail("`" + key + "` of a cell follows from the sweep",
                   "write it beside `command`, not below `fixed`");
      }
      design_.fixed.push_back({key, option_text(given, key), given.line()});
    }
  }

  void parse_axes(const YamlValue& value) {
    const YamlMap map(value, "axes");
    double points = 1;
    for (const std::string& key : map.keys()) {
      const YamlValue given = *map.find(key);
      check_own(map, key, given.line(), design_.file);
      Axis axis{key, given.line(), {}, 0, 0, 0};
      if (given.is_list()) {
        for (const YamlValue& item : given.list("a value of " + key)) axis.listed.push_back(item.text());
      } else {
        parse_range(given, design_.random, axis);
      }
      check_axis(axis, given);
      points *= static_cast<double>(axis.size());
      design_.axes.push_back(std::move(axis));
    }
    if (design_.axes.empty()) value.fail("there is no axis", "name an option and its values");
    const double cells =
        (design_.random ? static_cast<double>(design_.points) : points) * design_.repetitions;
    if (cells > static_cast<double>(kMostCells)) {
      value.fail(program::text("the design has %.3g cells; the limit is 100 million", cells),
                 "take larger steps, or `design: {random: N}`");
    }
    if (!design_.random) design_.points = static_cast<std::uint64_t>(points);
  }

  void check_axis(const Axis& axis, const YamlValue& given) const {
    for (const Option& fixed : design_.fixed) {
      if (!same_kind(fixed.name, axis.name)) continue;
      given.fail("axis " + axis.name + " contradicts the fixed " + fixed.name + " in line " +
                     std::to_string(fixed.line),
                 "keep one of them");
    }
    for (const Axis& other : design_.axes) {
      if (!same_kind(other.name, axis.name)) continue;
      given.fail("axis " + axis.name + " contradicts axis " + other.name + ": both set what runs the graph",
                 "make a sweep for each");
    }
    std::vector<std::string> sorted = axis.listed;
    std::ranges::sort(sorted);
    const auto duplicate = std::ranges::adjacent_find(sorted);
    if (duplicate == sorted.end()) return;
    given.fail("axis " + axis.name + " has " + *duplicate + " twice", "name it once");
  }

  static bool same_kind(const std::string& a, const std::string& b) {
    return a == b || (names_executor(a) && names_executor(b));
  }

  void parse_keep(const YamlValue& value) {
    if (design_.command == "analyze") value.fail("analyses write no folders", "leave `keep` out");
    design_.keep = value.choice({"none", "all"}) == 1;
  }

  Design design_;
};

}  // namespace

Design load_sweep(const std::string& file) { return Parser(file).parse(); }

}  // namespace hotpath::sweep
