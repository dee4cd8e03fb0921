// SPDX-License-Identifier: Apache-2.0
#include "sweep/design.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/hash.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

namespace {

constexpr const char* kRemedy = "a sweep is one YAML map with `command` and `axes`; see docs/sweeps.md";

/// Options of a command that the sweep sets itself.
const std::vector<std::string> kOwnOptions = {"output", "threads", "help", "csv", "quick"};

double number(const YamlValue& value) {
  const std::optional<double> parsed = hotpath::parse<double>(value.text());
  if (parsed && std::isfinite(*parsed)) return *parsed;
  value.fail("`" + value.text() + "` is not a number", "give a number");
}

/// The axis {from, to, step}.
Axis range_of(const YamlValue& value, const std::string& axis) {
  const YamlMap range(value, "axis " + axis);
  range.check_keys({"from", "to", "step"});
  const double low = number(range.require("from", "NUMBER"));
  const double high = number(range.require("to", "NUMBER"));
  if (low > high) range.fail("axis " + axis + " goes from high to low", "swap the ends");
  const YamlValue given = range.require("step", "NUMBER");
  const double step = number(given), steps = (high - low) / step + 1e-9;
  if (!(step > 0 && steps < static_cast<double>(kMostCells)))
    given.fail("this step is too small for a grid", "give a larger one");
  return {axis, value.line(), {}, low, step, static_cast<std::size_t>(steps) + 1};
}

std::vector<std::string> texts(const YamlValue& list, const std::string& item_name) {
  const std::vector<YamlValue> items = list.list(item_name);
  std::vector<std::string> words(items.size());
  std::ranges::transform(items, words.begin(), &YamlValue::text);
  return words;
}

/// The value of a key below `fixed` or `axes`, which the sweep must not set itself.
YamlValue option_value(const YamlMap& map, const std::string& key, const std::string& file) {
  YamlValue value = *map.find(key);
  if (std::ranges::count(kOwnOptions, key) > 0)
    throw InputError(file, value.line(), map.what() + " has `" + key + "`, which the sweep sets itself",
                     "leave it out");
  if (key == "seed" || key == "repetitions")
    value.fail("`" + key + "` of a cell follows from the sweep",
               "write it beside `command`, not below `" + map.what() + "`");
  return value;
}

void check_axis(const Axis& axis, const Design& design, const YamlValue& given) {
  const auto contradicts = [&](const auto& other) {
    return other.name == axis.name || (names_executor(other.name) && names_executor(axis.name));
  };
  const std::string contradiction = "axis " + axis.name + " contradicts ";
  const auto fixed = std::ranges::find_if(design.fixed, contradicts);
  if (fixed != design.fixed.end())
    given.fail(program::concat(contradiction, "the fixed ", fixed->name, " in line ", fixed->line),
               "keep one of them");
  const auto other = std::ranges::find_if(design.axes, contradicts);
  if (other != design.axes.end())
    given.fail(contradiction + "axis " + other->name + ": both set what runs the graph",
               "make a sweep for each");
  std::vector<std::string> sorted = axis.listed;
  std::ranges::sort(sorted);
  const auto duplicate = std::ranges::adjacent_find(sorted);
  if (duplicate != sorted.end())
    given.fail("axis " + axis.name + " has " + *duplicate + " twice", "name it once");
}

void parse_axes(const YamlValue& value, Design& design) {
  const YamlMap map(value, "axes");
  double cells = design.repetitions;
  for (const std::string& key : map.keys()) {
    const YamlValue given = option_value(map, key, design.file);
    Axis axis =
        given.is_list() ? Axis{key, given.line(), texts(given, "a value of " + key)} : range_of(given, key);
    check_axis(axis, design, given);
    cells *= static_cast<double>(axis.size());
    design.points *= axis.size();
    design.axes.push_back(std::move(axis));
  }
  if (design.axes.empty()) value.fail("there is no axis", "name an option and its values");
  if (cells > static_cast<double>(kMostCells)) {
    value.fail(program::text("the design has %.3g cells; the limit is 1 million", cells),
               "take larger steps, or make several sweeps");
  }
}

}  // namespace

bool names_executor(const std::string& option) { return option == "executors" || option == "deployments"; }

std::string Axis::value(std::size_t i) const {
  return listed.empty() ? program::text("%.10g", from + static_cast<double>(i) * step) : listed[i];
}

std::vector<Option> Design::coordinates(std::uint64_t cell) const {
  std::vector<Option> at(axes.size());
  std::uint64_t rest = cell / repetitions;
  for (std::size_t i = axes.size(); i-- > 0;) {
    at[i] = {axes[i].name, axes[i].value(rest % axes[i].size()), axes[i].line};
    rest /= axes[i].size();
  }
  return at;
}

std::uint64_t Design::seed_of(std::uint64_t cell) const {
  std::string place = std::to_string(seed) + ";";
  std::vector<Option> at = coordinates(cell);
  std::ranges::sort(at, {}, &Option::name);  // the order of axes in the file does not matter
  for (const Option& option : at) {
    if (!names_executor(option.name)) place += program::concat(option.name, "=", option.value, ";");
  }
  return program::hash_of(place + std::to_string(repetition(cell))) >> 11;  // 53 bits, exact in JSON
}

Design load_sweep(const std::string& file) {
  Design design;
  design.file = file;
  design.text = read_text_file(file);
  const YamlMap map(file, design.text, "the sweep", kRemedy);
  map.check_keys({"command", "fixed", "axes", "repetitions", "seed", "keep"});
  const std::vector<std::string> commands = {"simulate", "run", "analyze"};
  design.command = commands[map.require("command", "simulate").choice(commands)];
  constexpr std::int64_t kMost = std::int64_t{1} << 53;  // exact in JSON
  if (const auto seed = map.find("seed")) design.seed = static_cast<std::uint64_t>(seed->integer(0, kMost));
  if (const auto n = map.find("repetitions"))
    design.repetitions = static_cast<std::uint32_t>(n->integer(1, 10'000));
  if (const auto given = map.find("fixed")) {
    const YamlMap fixed(*given, "fixed");
    for (const std::string& key : fixed.keys()) {
      const YamlValue value = option_value(fixed, key, file);
      // A list of values that a cell uses together.
      design.fixed.push_back(
          {key, value.is_list() ? program::joined(texts(value, key), ",") : value.text(), value.line()});
    }
  }
  parse_axes(map.require("axes", "{load: {from: 20, to: 90, step: 10}}"), design);
  if (const auto keep = map.find("keep")) {
    if (design.command == "analyze") keep->fail("analyses write no folders", "leave `keep` out");
    design.keep = keep->choice({"none", "all"}) == 1;
  }
  return design;
}

}  // namespace hotpath::sweep
