// SPDX-License-Identifier: Apache-2.0
#include "comparison/sides.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>

#include "hotpath/core/input_file.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/json_record.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"
#include "results/stored_summary.hpp"

namespace hotpath::comparison {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// Reads a run into an empty side. Its repetitions have numbers from its seed, or from 0 if nothing is drawn.
class RunReader {
 public:
  RunReader(const fs::path& folder, Side& side) : run_(folder, "diff"), record_(run_.record()), side_(side) {
    const bool simulated = record_.kind == results::RunKind::simulated;
    const bool drawn = !simulated || record_.simulation->drawn || record_.phases == "random";
    if (drawn && record_.kind != results::RunKind::recorded) first_ = static_cast<std::int64_t>(record_.seed);
    side.graph = record_.graph.name;
    side.length.emplace(record_.warm_up_s, record_.duration_s);
    for (const results::RepetitionRecord& r : record_.runs) {
      if (!simulated) break;
      side.draws[{r.executor, first_ + r.repetition}] = {
          record_.simulation->execution_times, record_.warm_up_s, record_.duration_s, r.first_timestamps};
    }
  }

  void read(bool losses) {
    for (const std::string& chain : record_.chains) plan(Measure::outputs, Latency::age, chain);
    run_.for_each_chain([&](const ChainRow& row) {
      const std::int64_t number = first_ + row.repetition;
      Key key = key_of(Latency::age, run_.chains()[row.record.chain], row.executor);
      ++side_.counts[{Measure::outputs, key}][number];
      for (const Latency latency : {Latency::age, Latency::hot_path}) {
        key.latency = latency;
        if (const auto value = row.record.latency(latency))
          side_.samples[key].of(number).push_back(to_ms(*value));
      }
    });
    const bool has_jobs = fs::exists(run_.folder() / "jobs.csv");
    if (has_jobs) read_responses();
    if (losses) read_summary(!has_jobs);
  }

 private:
  Key key_of(std::optional<Latency> latency, const std::string& study, std::string_view executor) const {
    const bool simulated = record_.kind == results::RunKind::simulated;
    return {latency,
            study,
            simulated ? Source::simulated : Source::live,
            program::text("%g %%", record_.load_percent),
            std::string(executor),
            ""};
  }

  /// Every planned repetition has 0 outputs or jobs, unless samples tell otherwise.
  void plan(Measure measure, Latency latency, const std::string& study) {
    for (const std::string& executor : record_.executors) {
      Series& series = side_.counts[{measure, key_of(latency, study, executor)}];
      for (std::uint32_t r = 0; r < record_.repetitions; ++r) series[first_ + r] = 0;
    }
  }

  /// Samples of timers, and the jobs of all tasks.
  void read_responses() {
    for (const Task& task : run_.tasks().tasks) plan(Measure::jobs, Latency::response, task.name);
    results::for_each_record(run_, [&](const JobRow& row) {
      if (!results::counts(row.record, Time{} + run_.warm_up())) return;
      const Task& task = run_.tasks()[row.record.job.task];
      const Key key = key_of(Latency::response, task.name, row.executor);
      Series& jobs = side_.counts[{Measure::jobs, key}];
      if (!jobs.contains(first_ + row.repetition))
        static_cast<void>(run_.run(std::string(row.executor), row.repetition));  // throws: it did not run
      ++jobs[first_ + row.repetition];
      if (task.kind != TaskKind::timer) return;
      side_.samples[key].of(first_ + row.repetition).push_back(to_ms(row.record.response_time()));
    });
    for (auto& [key, samples] : side_.samples) {  // live repetitions are interleaved at random
      if (key.latency == Latency::response)
        std::ranges::sort(samples.repetitions, {}, &Samples::Repetition::number);
    }
  }

  /// Losses and, for a run that kept no jobs, the mean number of jobs.
  void read_summary(bool with_jobs) {
    const fs::path file = run_.folder() / "summary.json";
    use_json(file, "hotpath", [&](const json& summary) {
      for (const json& executor : summary.at("executors")) {
        const std::string name = executor.at("executor");
        Series& losses = side_.counts[{Measure::losses, key_of(std::nullopt, record_.graph.name, name)}];
        for (const json& r : executor.at("losses")) {
          losses[first_ + r.at("repetition").get<std::int64_t>()] =
              r.at("skipped").get<double>() + r.at("overwritten").get<double>();
        }
        for (const json& task : executor.at("tasks")) {
          if (!with_jobs) break;
          Series& jobs = side_.counts[{Measure::jobs, key_of(Latency::response, task.at("task"), name)}];
          for (std::uint32_t r = 0; r < record_.repetitions; ++r)
            jobs[first_ + r] = task.at("response_ms").at("n").get<double>() / record_.repetitions;
        }
      }
    });
  }

  const results::StoredRun run_;
  const results::RunRecord& record_;
  Side& side_;
  std::int64_t first_ = 0;
};

/// Adds a part, whose repetitions may have numbers of other parts.
void add(Side part, Side& side) {
  for (auto& [key, samples] : part.samples) {
    auto& all = side.samples[key].repetitions;
    std::ranges::move(samples.repetitions, std::back_inserter(all));
  }
  for (const auto& [of, series] : part.counts) {
    for (const auto& [number, count] : series) side.counts[of][number] = count;
  }
  part.draws.merge(side.draws);
  side.draws = std::move(part.draws);
  if (!side.length) side.length = part.length;
  side.graph = part.graph;
}

}  // namespace

bool draws_agree(const Side& before, const Side& after, const std::string& executor) {
  return std::ranges::all_of(before.draws, [&](const auto& of) {
    const auto other = after.draws.find(of.first);
    if (of.first.first != executor || other == after.draws.end()) return true;
    const Draw &a = of.second, &b = other->second;
    return std::tie(a.execution_times, a.warm_up_s, a.duration_s) ==
               std::tie(b.execution_times, b.warm_up_s, b.duration_s) &&
           std::ranges::all_of(a.first_timestamps, [&](const auto& timer) {
             const auto first = b.first_timestamps.find(timer.first);
             return first == b.first_timestamps.end() || first->second == timer.second;
           });
  });
}

std::string text_of(const Key& key) {
  std::string text = key.latency ? to_string(*key.latency) : "lost";
  for (const std::string& part :
       {key.study, std::string(to_string(key.source)), key.setting, key.executor, key.tasks}) {
    if (!part.empty()) text += " " + part;
  }
  return text;
}

std::vector<double>& Samples::of(std::int64_t number) {
  const auto found = std::ranges::find(repetitions.rbegin(), repetitions.rend(), number, &Repetition::number);
  return found == repetitions.rend() ? repetitions.emplace_back(Repetition{number, {}}).ms : found->ms;
}

RepeatedSamples Samples::resampled() const {
  std::vector<std::vector<double>> units;
  for (const Repetition& r : repetitions) units.push_back(r.ms);
  return results::resampled(std::move(units), exact());
}

std::vector<fs::path> parts_of(const fs::path& folder) {
  std::vector<fs::path> parts;
  if (fs::exists(folder / "run.json")) return parts;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    if (fs::exists(entry.path() / "run.json", none)) parts.push_back(entry.path());
  }
  std::ranges::sort(parts);
  return parts;
}

Side read_side(const fs::path& folder, bool losses) {
  Side side;
  std::vector<fs::path> parts = parts_of(folder);
  const bool one = parts.empty();
  if (!add_reproduction(folder, side)) {
    if (one && !fs::exists(folder / "run.json")) {
      throw program::UsageError(folder.string() +
                                ": neither a reproduction (data/hot_path.csv.gz) nor a run (run.json); "
                                "give a folder of `reproduce_paper.sh` or of `hotpath`");
    }
    if (one) parts.push_back(folder);
    for (const fs::path& folder_of_part : parts) {
      Side part;
      RunReader(folder_of_part, part).read(losses);
      add(std::move(part), side);
    }
  }
  for (auto& [key, samples] : side.samples) samples.deterministic = one && key.source == Source::simulated;
  return side;
}

void use_json(const fs::path& file, const std::string& made_by, const std::function<void(const json&)>& use) {
  std::ifstream in = open_input(file, "give a folder written by `" + made_by + "`");
  const auto refuse = [&](const std::exception& error) {
    return program::UsageError(file.string() + ": not written by `" + made_by + "`: " + error.what());
  };
  try {
    use(program::parse_shallow(in));
  } catch (const json::exception& error) {
    throw refuse(error);
  } catch (const std::out_of_range& error) {
    throw refuse(error);
  }
}

}  // namespace hotpath::comparison
