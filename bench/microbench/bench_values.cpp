// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_values.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

namespace hotpath {

namespace {

using nlohmann::json;

double nanoseconds(const std::string& unit) {
  if (unit == "ns") return 1;
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  if (unit == "s") return 1e9;
  throw std::invalid_argument("unknown time unit `" + unit + "`");
}

/// Numbers of Google Benchmark's own that are no bench.
bool is_bookkeeping(std::string_view key) {
  constexpr std::array<std::string_view, 9> own = {"family_index",    "per_family_instance_index",
                                                   "repetitions",     "repetition_index",
                                                   "threads",         "iterations",
                                                   "real_time",       "cpu_time",
                                                   "items_per_second"};
  return std::find(own.begin(), own.end(), key) != own.end();
}

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
  auto known = std::find_if(bench.complexities.begin(), bench.complexities.end(),
                            [&](const auto& c) { return c.benchmark == benchmark; });
  if (known == bench.complexities.end()) {
    known = bench.complexities.insert(bench.complexities.end(), {benchmark, "", 0, 0});
  }
  if (row.at("aggregate_name") == "BigO") {
    known->order = row.at("big_o");
    known->coefficient_ns = row.at("real_coefficient").get<double>() * nanoseconds(row.at("time_unit"));
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
  bench.values[{benchmark, "time_ns"}].push_back(row.at("real_time").get<double>() *
                                                 nanoseconds(row.at("time_unit")));
  for (const auto& [key, value] : row.items()) {
    if (value.is_number() && !is_bookkeeping(key)) bench.values[{benchmark, key}].push_back(value);
  }
}

}  // namespace

void add_google_benchmark_output(BenchValues& bench, const json& output) {
  try {
    for (const json& row : output.at("benchmarks")) add_row(bench, row);
  } catch (const json::exception& error) {
    throw std::invalid_argument(std::string("not the JSON of Google Benchmark: ") + error.what());
  }
}

json to_json(const BenchValues& bench) {
  json rows = json::array(), complexities = json::array();
  for (const auto& [key, values] : bench.values) {
    rows.push_back({{"benchmark", key.first}, {"metric", key.second}, {"values", values}});
  }
  for (const auto& c : bench.complexities) {
    complexities.push_back({{"benchmark", c.benchmark},
                            {"order", c.order},
                            {"coefficient_ns", c.coefficient_ns},
                            {"rms_percent", c.rms_percent}});
  }
  return {{"figures", rows}, {"complexities", complexities}, {"errors", bench.errors}};
}

BenchValues bench_values_from_json(const json& content) {
  BenchValues bench;
  try {
    for (const json& row : content.at("figures")) {
      bench.values[{row.at("benchmark"), row.at("metric")}] = row.at("values").get<std::vector<double>>();
    }
    for (const json& row : content.at("complexities")) {
      bench.complexities.push_back({row.at("benchmark"), row.at("order"),
                                    row.at("coefficient_ns").get<double>(),
                                    row.at("rms_percent").get<double>()});
    }
    bench.errors = content.at("errors").get<std::vector<std::string>>();
  } catch (const json::exception& error) {
    throw std::invalid_argument(std::string("not written by `hotpath bench`: ") + error.what());
  }
  return bench;
}

}  // namespace hotpath
