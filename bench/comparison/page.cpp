// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "comparison/report.hpp"
#include "program/json_fields.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"

namespace hotpath::comparison {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int kPointsOfDecade = 20;  // of the logarithmic tail of a distribution

double rounded(double value, double digits) { return std::nearbyint(value * digits) / digits; }

/// Where a distribution of `n` samples is drawn: evenly up to 0.9, then evenly on the logarithmic axis up
/// to the last probability that `n` samples resolve, and 1.
std::vector<double> probabilities(std::size_t n) {
  std::vector<double> found;
  for (int k = 0; k <= 45; ++k) found.push_back(k / 50.0);
  const double decades = std::max(0.0, std::log10(static_cast<double>(n)) - 1);
  for (int k = 1; k <= static_cast<int>(decades * kPointsOfDecade); ++k)
    found.push_back(rounded(1 - 0.1 * std::pow(10.0, -static_cast<double>(k) / kPointsOfDecade), 1e12));
  found.push_back(1);
  return found;
}

/// A distribution with its intervals, in ms rounded to nanoseconds.
json curve_of(int side, const std::string& executor, const Samples& samples) {
  const RepeatedSamples all = samples.resampled();
  const std::vector<double> q = probabilities(all.pooled().size());
  json value, low, high;
  for (const Estimate& e : estimate_quantiles(all, q)) {
    value.push_back(rounded(e.value, 1e6));
    low.push_back(e.interval ? json(rounded(e.interval->low, 1e6)) : json());
    high.push_back(e.interval ? json(rounded(e.interval->high, 1e6)) : json());
  }
  return {{"side", side},
          {"executor", executor},
          {"n", all.pooled().size()},
          {"q", q},
          {"repetitions", samples.repetitions.size()},
          {"value", value},
          {"low", low},
          {"high", high}};
}

/// The distributions of each key without its executor that both sides have.
json targets_of(const Side& before, const Side& after) {
  std::map<Key, json> curves;
  std::vector<Key> order;
  for (const Side* const side : {&before, &after}) {
    for (const auto& [key, samples] : side->samples) {
      if (!before.samples.contains(key) || !after.samples.contains(key)) continue;
      Key target = key;
      target.executor.clear();
      if (!curves.contains(target)) order.push_back(target);
      curves[target].push_back(curve_of(side == &after, key.executor, samples));
    }
  }
  json targets = json::array();
  for (const Key& key : order)
    targets.push_back({{"kind", key.quantity <= Quantity::hot_path ? "chain" : "task"},
                       {"name", text_of(key)},
                       {"hot_path", key.quantity == Quantity::hot_path},
                       {"curves", curves[key]}});
  return targets;
}

std::string name_of(const fs::path& folder) {
  const fs::path whole = fs::weakly_canonical(folder);
  return (whole.has_filename() ? whole : whole.parent_path()).filename();
}

}  // namespace

void write_page(const Options& options, const Side& before, const Side& after,
                const std::vector<std::string>& sentences, const std::string& title,
                const program::Table& table) {
  const fs::path folder = options.page;
  const bool are_runs = fs::exists(options.old / "run.json") && fs::exists(options.now / "run.json");
  json facts = {"Old: " + options.old.string(), "New: " + options.now.string()};
  for (const std::string& sentence : sentences) facts.push_back(sentence);
  json cells = json::array();
  for (const std::vector<program::Value>& row : table.rows) {
    json& texts = cells.emplace_back();
    for (const program::Value& value : row) texts.push_back(value.text());
  }
  program::create_folder(folder, "--page");
  program::write_whole_file(folder / "comparison.json", "--page",
                            json{{"version", 1},
                                 {"title", name_of(options.old) + " against " + name_of(options.now)},
                                 {"facts", facts},
                                 {"folders", {options.old.string(), options.now.string()}},
                                 {"table", {{"title", title}, {"columns", table.header}, {"cells", cells}}},
                                 {"targets", are_runs ? json() : targets_of(before, after)}});
  program::call_python_tool("comparison", {folder.string()});
}

}  // namespace hotpath::comparison
