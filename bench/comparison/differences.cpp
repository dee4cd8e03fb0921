// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "comparison/report.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath::comparison {

using nlohmann::json;
using program::text;

namespace {

/// Numbers of Google Benchmark's own that are no result, and times, which its compare.py compares.
const std::set<std::string> kNoCounters = {"family_index", "per_family_instance_index",
                                           "repetitions",  "repetition_index",
                                           "threads",      "iterations",
                                           "real_time",    "cpu_time"};

/// As JSON, which also stores an empty text.
json interval_text(const char* format, const std::optional<Interval>& interval) {
  return interval ? text(format, interval->low, interval->high) : "";
}

/// The counters of a result of `hotpath bench`, by benchmark and name: a value for each repetition.
std::map<std::string, Samples> read_counters(const std::filesystem::path& file) {
  std::map<std::string, Samples> counters;
  use_json(file, "hotpath bench", [&](const json& bench) {
    static_cast<void>(bench.at("context").at("machine"));
    if (bench.at("benchmarks").empty())
      throw program::UsageError(file.string() + ": no measurements, there is nothing to report");
    for (const json& row : bench.at("benchmarks")) {
      static_cast<void>(row.at("real_time").get<double>());
      const auto benchmark = row.at("name").get<std::string>();
      for (const auto& [name, value] : row.items()) {
        if (!value.is_number() || kNoCounters.contains(name)) continue;
        Samples& samples = counters[program::concat(benchmark, " ", name)];
        samples.of(static_cast<std::int64_t>(samples.repetitions.size())).push_back(value.get<double>());
      }
    }
  });
  return counters;
}

/// Three significant digits, trailing zeros kept, never with an exponent.
std::string three_digits(double value) {
  return value <= 0 ? "0"
                    : text("%.*f", std::max(0, 2 - static_cast<int>(std::floor(std::log10(value)))), value);
}

}  // namespace

/// Whether the i-th repetitions of both sides are pairs.
static bool are_pairs(const Key& key, const Side& before, const Side& after) {
  return key.source == Source::simulated &&
         std::ranges::equal(before.samples.at(key).repetitions, after.samples.at(key).repetitions, {},
                            &Samples::Repetition::number, &Samples::Repetition::number) &&
         draws_agree(before, after, key.executor);
}

Verdict verdict_of(const Samples& old, const Samples& now, const Estimate& change) {
  const bool exact = old.exact() && now.exact();
  if (!exact && !change.interval) return Verdict::not_comparable;
  const auto [low, high] = exact ? Interval{change.value, change.value} : *change.interval;
  if (low < kNothing_ms && high > -kNothing_ms) return Verdict::same;
  return low > 0 ? Verdict::worse : Verdict::better;
}

Percentiles percentiles_of(const Side& before, const Side& after) {
  using Row = std::vector<program::Value>;
  Percentiles all{
      program::Table("", {"quantity", "study", "source", "setting", "executor", "tasks", "percentile",
                          "old_ms", "new_ms", "difference_ms", "interval_95_ms", "verdict"}),
      program::Table("", {"", "", "old ms", "new ms", "difference", "95 % interval", ""}),
      {}};
  for (const auto& [key, samples] : before.samples) {
    const auto other = after.samples.find(key);
    if (other == after.samples.end()) continue;
    const RepeatedSamples old = samples.resampled(), now = other->second.resampled();
    const BootstrapOptions resampling = {.pairs = are_pairs(key, before, after)};
    for (const auto& [judged, word] : enum_texts(results::Judged{})) {
      const auto& [percentile, p, of, has_interval] = results::traits_of(judged);
      const Estimate change = difference_of_quantiles(now, old, p, resampling);
      const Verdict verdict = verdict_of(samples, other->second, change);
      ++all.verdicts[*key.latency][verdict];
      const std::string why = verdict == Verdict::not_comparable ? " (too few samples)" : "";
      Row stored = {key.latency,       json(key.study),    key.source,
                    json(key.setting), json(key.executor), json(key.tasks)};
      Row shown = {text_of(key)};
      for (Row* const row : {&stored, &shown})
        row->insert(row->end(), {percentile, text("%.3f", quantile(old.pooled(), p)),
                                 text("%.3f", quantile(now.pooled(), p)), text("%+.3f", change.value),
                                 interval_text("[%+.3f, %+.3f]", change.interval), to_string(verdict) + why});
      all.stored.add_row(stored);
      all.shown.add_row(shown);
    }
  }
  return all;
}

void compare_counters(const Options& options) {
  const auto old_file = options.old / "bench.json", file = options.now / "bench.json";
  const auto before = read_counters(old_file), after = read_counters(file);
  program::Table table("", {"counter", "old", "new", "difference", "95 % interval", "verdict"});
  std::size_t beyond = 0;
  for (const auto& [name, samples] : before) {
    const auto other = after.find(name);
    if (other == after.end()) continue;
    const RepeatedSamples old = samples.resampled(), now = other->second.resampled();
    const Estimate change = difference_of_quantiles(now, old, 0.5);
    const Verdict verdict = verdict_of(samples, other->second, change);
    const bool differs =
        verdict == Verdict::worse || verdict == Verdict::better;  // the counter has no direction
    beyond += differs;
    table.add_row({name, three_digits(quantile(old.pooled(), 0.5)), three_digits(quantile(now.pooled(), 0.5)),
                   text("%+.3g", change.value), interval_text("[%+.3g, %+.3g]", change.interval),
                   differs ? "differs beyond noise" : to_string(verdict)});
  }
  if (table.rows.empty()) {
    throw program::UsageError(options.old.string() + " and " + options.now.string() +
                              " have no counter in common, there is nothing to compare");
  }
  program::show_json(json_of(table));
  table.header.back().clear();
  std::cout << table << beyond << " of " << table.rows.size() << " counters differ beyond noise.\n"
            << "Times: /usr/share/benchmark/compare.py benchmarks " << old_file.string() << " "
            << file.string() << "\n";
}

}  // namespace hotpath::comparison
