// SPDX-License-Identifier: Apache-2.0
#include "comparison/comparison.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "comparison/report.hpp"
#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::comparison {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr double kToldDropPoints = 0.1;

Key with_setting(Key key, const std::string& setting) {
  key.setting = setting;
  return key;
}

/// What a side has, besides losses, by load.
std::map<std::string, std::set<Key>> keys_of(const Side& side) {
  std::map<std::string, std::set<Key>> keys;
  for (const auto& [key, _] : side.samples) keys[key.setting].insert(with_setting(key, ""));
  for (const auto& [of, _] : side.counts) {
    if (of.first != Measure::losses) keys[of.second.setting].insert(with_setting(of.second, ""));
  }
  return keys;
}

std::string loads_of(const Side& side) {
  std::vector<std::string> loads;
  for (const auto& [load, _] : keys_of(side)) loads.push_back(load);
  return program::joined(loads);
}

/// Gives both sides one setting. Throws UsageError if a side has several.
void set_common_load(Side& before, Side& after) {
  std::string both;
  for (const Side* const side : {&before, &after}) {
    const std::string load = loads_of(*side);
    if (keys_of(*side).size() > 1)
      throw program::UsageError("--across-loads compares runs of one load each, and one side has " + load);
    if (load != both) both += (both.empty() || load.empty() ? "" : " to ") + load;
  }
  for (Side* const side : {&before, &after}) {
    auto samples = std::exchange(side->samples, {});
    auto counts = std::exchange(side->counts, {});
    for (auto& [key, of] : samples) side->samples[with_setting(key, both)] = std::move(of);
    for (auto& [of, series] : counts)
      side->counts[{of.first, with_setting(of.second, both)}] = std::move(series);
  }
}

/// Scales counts to the shorter repetition.
void scale_counts(Side& side, const Side& other) {
  if (!side.length || !other.length) return;
  const auto [warm_up, duration] = *side.length;
  const auto [other_warm_up, other_duration] = *other.length;
  for (auto& [of, series] : side.counts) {
    const double factor = of.first == Measure::losses
                              ? (other_warm_up + other_duration) / (warm_up + duration)
                              : other_duration / duration;
    for (auto& [_, count] : series) count *= std::min(1.0, factor);
  }
}

/// Names the repetitions of a side without any output of a chain.
void add_empty(const fs::path& folder, const Side& side, std::vector<std::string>& sentences) {
  for (const auto& [of, series] : side.counts) {
    std::vector<std::string> empty;
    std::size_t repetition = 0;
    for (const auto& [_, count] : series) {
      if (count == 0) empty.push_back(program::concat(repetition));
      ++repetition;
    }
    if (of.first != Measure::outputs || empty.empty()) continue;
    sentences.push_back(program::concat(
        "No output of ", of.second.study, " under ", of.second.executor, " in ",
        empty.size() == series.size() ? "any repetition" : "repetition " + program::joined(empty), " of ",
        folder.string()));
  }
}

/// What makes the sides unequal: graphs, lengths, and repetitions without outputs.
std::vector<std::string> cautions(const Options& o, const Side& before, const Side& after) {
  std::vector<std::string> sentences;
  if (before.graph != after.graph)
    sentences.push_back("The graphs differ (" + before.graph + ", " + after.graph +
                        "): tasks and chains pair up by name");
  if (before.length && after.length && before.length->second != after.length->second)
    sentences.push_back(program::concat(o.old.string(), " lasts ", before.length->second, " s, ",
                                        o.now.string(), " ", after.length->second,
                                        " s: maxima grow with the length, counts are scaled to the shorter"));
  add_empty(o.old, before, sentences);
  add_empty(o.now, after, sentences);
  return sentences;
}

/// Throws the error for sides that have nothing in common, with a hint if only the loads differ.
[[noreturn]] void refuse(const Options& o, const Side& before, const Side& after) {
  std::set<Key> old, both;
  for (const auto& [_, keys] : keys_of(before)) old.insert(keys.begin(), keys.end());
  for (const auto& [_, keys] : keys_of(after))
    std::ranges::set_intersection(old, keys, std::inserter(both, both.end()));
  if (loads_of(before) != loads_of(after) && !both.empty())
    throw program::UsageError(o.old.string() + " has load " + loads_of(before) + ", " + o.now.string() + " " +
                              loads_of(after) + "; compare them with --across-loads");
  throw program::UsageError(o.old.string() + " and " + o.now.string() +
                            " have no executor and setting in common, there is nothing to compare" +
                            (before.graph == after.graph ? "" : ". " + cautions(o, before, after).front()));
}

/// Sentences about other differences of two reproductions: dropped jobs, verdicts and modes.
std::vector<std::string> other_differences(const Options& o) {
  std::vector<std::string> sentences;
  const auto drops = drop_rates(o.now);
  for (const auto& [key, rate] : drop_rates(o.old)) {
    const auto now = drops.find(key);
    if (now == drops.end() || std::abs(now->second - rate) < kToldDropPoints) continue;
    const std::string what = text_of(key).substr(std::string_view("lost ").size());
    sentences.push_back(
        program::text("dropped jobs, %s: %.2f %% before, %.2f %% now", what.c_str(), rate, now->second));
  }
  const auto of_both = [&](const char* file, const auto& read) {
    if (!fs::exists(o.old / file) || !fs::exists(o.now / file)) return;
    use_json(o.old / file, "reproduce_paper.sh", [&](const json& old) {
      use_json(o.now / file, "reproduce_paper.sh", [&](const json& now) { read(old, now); });
    });
  };
  of_both("claims.json", [&](const json& old, const json& now) {
    std::map<std::string, std::pair<std::string, std::string>> verdicts;  // by claim: before, now
    for (const json& claim : old) verdicts[claim.at("claim")].first = claim.at("verdict");
    for (const json& claim : now) verdicts[claim.at("claim")].second = claim.at("verdict");
    for (const auto& [claim, of] : verdicts) {
      if (of.first.empty() || of.second.empty() || of.first == of.second) continue;
      sentences.push_back("verdict of " + claim + ": " + of.first + " before, " + of.second + " now");
    }
  });
  of_both("facts.json", [&](const json& old, const json& now) {
    const std::string before = old.at("mode"), mode = now.at("mode");
    if (before == mode) return;
    sentences.push_back("the modes differ (" + before + ", " + mode +
                        "): maxima depend on the length of runs");
  });
  return sentences;
}

/// Names the executors and studies that one side alone has; empty: there are none.
std::vector<std::string> only_in(const fs::path& folder, const Side& side, const Side& other) {
  std::set<std::string> only, executors;
  for (const auto& [key, _] : other.samples) executors.insert(key.executor);
  for (const auto& [key, _] : side.samples) {
    if (other.samples.contains(key)) continue;
    only.insert(executors.contains(key.executor) ? text_of({key.latency, key.study, key.source, "", "", ""})
                                                 : key.executor);
  }
  if (only.empty()) return {};
  return {"Not comparable, only in " + folder.string() + ": " + program::joined(only)};
}

void compare_percentiles(const Options& o) {
  Side before = read_side(o.old, false), after = read_side(o.now, false);
  if (o.across_loads) set_common_load(before, after);
  auto [stored, shown, verdicts] = percentiles_of(before, after);
  if (stored.rows.empty()) refuse(o, before, after);
  if (!o.csv.empty()) program::write_output_file(o.csv, "--csv", csv_of(stored));
  std::vector<std::string> sentences;
  for (const auto& [latency, counts] : verdicts)
    sentences.push_back(
        program::concat("By ", to_string(latency), ": ", verdict_of(counts, "percentiles"), ")"));
  for (const auto& more : {cautions(o, before, after), only_in(o.old, before, after),
                           only_in(o.now, after, before), other_differences(o)})
    sentences.insert(sentences.end(), more.begin(), more.end());
  std::cout << program::joined(sentences, "\n") << "\n\n" << shown;
  program::show_json(json_of(stored));
  if (o.output.empty()) return;
  shown.header = {"", "percentile", "old ms", "new ms", "difference ms", "95 % interval", ""};
  write_page(o, before, after, sentences, "Differences", shown);
}

/// Reads both sides for the gate. Throws UsageError.
std::pair<Side, Side> comparable(const Options& o) {
  std::pair<Side, Side> both{read_side(o.old, true), read_side(o.now, true)};
  auto& [before, after] = both;
  if (before.mode != after.mode) {
    const auto said = [](const std::string& mode) { return mode.empty() ? "a run" : mode; };
    throw program::UsageError(o.old.string() + ", " + o.now.string() + ": repetitions differ in length (" +
                              said(before.mode) + " and " + said(after.mode) + ")");
  }
  scale_counts(before, after);
  scale_counts(after, before);
  for (Side* const side : {&before, &after}) {  // latencies of chains or, without chains, response times
    const auto is_output = [](const auto& of) { return of.first.first == Measure::outputs; };
    if (std::ranges::any_of(side->counts, is_output))
      std::erase_if(side->samples, [](const auto& of) { return of.first.latency > Latency::hot_path; });
  }
  if (o.across_loads) set_common_load(before, after);
  const auto is_common = [&](const auto& of) {
    return of.first.first != Measure::losses && after.counts.contains(of.first);
  };
  if (std::ranges::none_of(before.counts, is_common)) refuse(o, before, after);
  return both;
}

bool run_gate(const Options& o) {
  const auto [before, after] = comparable(o);
  // `hotpath run --against` measured both sides by turns, in sibling folders.
  const auto around = [](const fs::path& folder) { return fs::weakly_canonical(folder / ".").parent_path(); };
  const bool by_turns =
      !parts_of(o.old).empty() && !parts_of(o.now).empty() && around(o.old) == around(o.now);
  const std::vector<std::string> unequal = cautions(o, before, after);
  std::vector<Judgement> judgements;
  try {
    judgements = judge(before, after, by_turns);
  } catch (const program::UsageError& error) {
    throw program::UsageError(
        program::concat(error.what(), unequal.empty() ? "" : ". ", program::joined(unequal, ". ")));
  }
  if (judgements.empty()) {
    throw program::UsageError(o.old.string() +
                              ": no output and no job after the warm-up, there is nothing to judge");
  }
  std::vector<std::string> sentences = {verdict_of(judgements), power_of(judgements)};
  sentences.insert(sentences.end(), unequal.begin(), unequal.end());
  std::cout << program::joined(sentences, "\n") << "\n\n" << rows_of(judgements, false);
  program::show_json(json_of(judgements));
  if (!o.junit.empty()) program::write_output_file(o.junit, "--junit", junit_of(judgements));
  if (!o.markdown.empty()) program::write_output_file(o.markdown, "--markdown", markdown_of(judgements, o));
  if (!o.output.empty()) write_page(o, before, after, sentences, "Verdicts", rows_of(judgements, true));
  return std::ranges::count(judgements, Verdict::worse, &Judgement::verdict) > 0;
}

}  // namespace

bool compare(const Options& options) {
  if (options.gate) return run_gate(options);
  const bool benchmarks = fs::exists(options.old / "bench.json") && fs::exists(options.now / "bench.json");
  benchmarks ? compare_counters(options) : compare_percentiles(options);
  return false;
}

}  // namespace hotpath::comparison
