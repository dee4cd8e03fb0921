// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_values.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath {

namespace {

using nlohmann::json;

double nanoseconds(const json& row, const char* key) {
  static const std::map<std::string, double> units = {{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}};
  return row.at(key).get<double>() * units.at(row.at("time_unit"));
}

/// Numbers of Google Benchmark's own that are no result.
const std::set<std::string> kBookkeeping = {"family_index",    "per_family_instance_index",
                                            "repetitions",     "repetition_index",
                                            "threads",         "iterations",
                                            "real_time",       "cpu_time",
                                            "items_per_second"};

/// `/iterations:1/manual_time` and the like say how it was measured, not what.
std::string without_modifiers(std::string name) {
  for (const char* modifier : {"/iterations:", "/manual_time", "/min_time:", "/real_time", "/repeats:"}) {
    const std::size_t at = name.find(modifier);
    if (at == std::string::npos) continue;
    const std::size_t end = name.find('/', at + 1);
    name.erase(at, end == std::string::npos ? end : end - at);
  }
  return name;
}

void add_complexity(BenchValues& bench, const json& row) {
  const std::string benchmark = without_modifiers(row.at("run_name"));
  auto known = std::ranges::find(bench.complexities, benchmark, &BenchValues::Complexity::benchmark);
  if (known == bench.complexities.end()) {
    known = bench.complexities.insert(bench.complexities.end(), {benchmark, "", 0, 0});
  }
  if (row.at("aggregate_name") == "BigO") {
    known->order = row.at("big_o");
    known->coefficient_ns = nanoseconds(row, "real_coefficient");
  } else if (row.at("aggregate_name") == "RMS") {
    known->rms_percent = row.at("rms").get<double>() * 100;
  }
}

void add_row(BenchValues& bench, const json& row) {
  if (row.value("run_type", "") == "aggregate") {
    add_complexity(bench, row);
    return;
  }
  const std::string benchmark = without_modifiers(row.at("name"));
  if (row.value("error_occurred", false)) {
    bench.errors.push_back(benchmark + ": " + row.value("error_message", ""));
    return;
  }
  bench.values[{benchmark, "time_ns"}].push_back(nanoseconds(row, "real_time"));
  for (const auto& [key, value] : row.items()) {
    if (value.is_number() && !kBookkeeping.contains(key)) bench.values[{benchmark, key}].push_back(value);
  }
}

/// Every repetition is one sample.
RepeatedSamples repetitions(const std::vector<double>& values) {
  std::vector<std::vector<double>> samples;
  for (const double v : values) samples.push_back({v});
  return RepeatedSamples(std::move(samples));
}

bool comparable(const std::vector<double>& values) {
  return values.size() >= kLeastRepetitions &&
         std::ranges::all_of(values, [](double v) { return std::isfinite(v) && v > 0; });
}

bool beyond_noise(const ValueComparison& c) {
  return c.verdict == Verdict::smaller || c.verdict == Verdict::larger;
}

/// 0 within noise.
double effect(const ValueComparison& c) { return beyond_noise(c) ? std::abs(std::log(c.ratio.value)) : 0; }

}  // namespace

void add_google_benchmark_output(BenchValues& bench, const json& output) {
  for (const json& row : output.at("benchmarks")) add_row(bench, row);
}

void to_json(json& j, const BenchValues& bench) {
  j = {{"figures", json::array()}, {"complexities", bench.complexities}, {"errors", bench.errors}};
  for (const auto& [key, values] : bench.values) {
    j["figures"].push_back({{"benchmark", key.first}, {"metric", key.second}, {"values", values}});
  }
}

void from_json(const json& j, BenchValues& bench) {
  for (const json& row : j.at("figures")) {
    row.at("values").get_to(bench.values[{row.at("benchmark"), row.at("metric")}]);
  }
  j.at("complexities").get_to(bench.complexities);
  j.at("errors").get_to(bench.errors);
}

std::vector<ValueComparison> compare_values(const BenchValues& before, const BenchValues& after,
                                            std::uint64_t seed) {
  BootstrapOptions options;
  options.confidence = kCompareConfidence;
  options.seed = seed;
  std::vector<ValueComparison> comparisons;
  for (const auto& [key, old_values] : before.values) {
    const auto found = after.values.find(key);
    if (found == after.values.end()) continue;
    ValueComparison c{key.first, key.second, kNoValue, kNoValue, {}, Verdict::not_comparable};
    const RepeatedSamples old_samples = repetitions(old_values), new_samples = repetitions(found->second);
    c.before = quantile(old_samples.pooled(), 0.5);
    c.after = quantile(new_samples.pooled(), 0.5);
    if (comparable(old_values) && comparable(found->second)) {
      c.ratio = ratio_of_quantiles(new_samples, old_samples, 0.5, options);
      c.verdict = c.ratio.interval->high < 1  ? Verdict::smaller
                  : c.ratio.interval->low > 1 ? Verdict::larger
                                              : Verdict::within_noise;
    }
    comparisons.push_back(std::move(c));
  }
  return comparisons;
}

void write_comparison(std::ostream& out, const std::vector<ValueComparison>& comparisons) {
  std::vector<ValueComparison> rows = comparisons;
  std::ranges::stable_sort(rows, std::greater<>(), effect);
  TextTable table("", {"value", "before", "after", "ratio", "[99 % interval]", ""});
  for (const ValueComparison& c : rows) {
    const auto& interval = c.ratio.interval;
    table.add_row({c.benchmark + " " + c.metric, fixed(c.before, 1), fixed(c.after, 1),
                   interval ? fixed(c.ratio.value, 3) : "",
                   interval ? text("[%.3f, %.3f]", interval->low, interval->high) : "",
                   to_string(c.verdict)});
  }
  out << table << std::ranges::count_if(rows, beyond_noise) << " of " << rows.size()
      << " values differ beyond noise.\n";
}

}  // namespace hotpath
