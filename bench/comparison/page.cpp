// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "comparison/report.hpp"
#include "program/json_record.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "results/stored_summary.hpp"

namespace hotpath::comparison {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

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
      json& curve = curves[target].emplace_back(results::curve_of(samples.resampled()));
      curve.update({{"side", static_cast<int>(side == &after)},
                    {"executor", key.executor},
                    {"repetitions", samples.repetitions.size()}});
    }
  }
  json targets = json::array();
  for (const Key& key : order)
    targets.push_back({{"kind", key.latency == Latency::response ? "task" : "chain"},
                       {"name", text_of(key)},
                       {"hot_path", key.latency == Latency::hot_path},
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
  const fs::path folder = options.output;
  const bool are_runs = fs::exists(options.old / "run.json") && fs::exists(options.now / "run.json");
  json facts = {"Old: " + options.old.string(), "New: " + options.now.string()};
  for (const std::string& sentence : sentences) facts.push_back(sentence);
  json cells = json::array();
  for (const std::vector<program::Value>& row : table.rows) {
    json& texts = cells.emplace_back();
    for (const program::Value& value : row) texts.push_back(value.text());
  }
  program::create_folder(folder, "--output");
  program::write_whole_file(folder / "comparison.json", "--output",
                            json{{"version", HOTPATH_VERSION},
                                 {"title", name_of(options.old) + " against " + name_of(options.now)},
                                 {"facts", facts},
                                 {"folders", {options.old.string(), options.now.string()}},
                                 {"table", {{"title", title}, {"columns", table.header}, {"cells", cells}}},
                                 {"targets", are_runs ? json() : targets_of(before, after)}});
  program::call_python_tool("comparison", {folder.string()});
}

}  // namespace hotpath::comparison
