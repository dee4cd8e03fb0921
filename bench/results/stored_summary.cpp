// SPDX-License-Identifier: Apache-2.0
#include "results/stored_summary.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath::results {

namespace {

constexpr std::size_t kBlocks = 20, kLeastForBlocks = 4 * kBlocks;
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

/// The repetitions of a stored run, with the measures of their jobs instead of the jobs.
class Repetitions {
 public:
  using Key = std::pair<std::string, std::uint32_t>;  // executor and repetition

  Repetitions(const StoredRun& run, Duration warm_up) : run_(run), warm_up_(warm_up) {}

  void add(const JobRow& row) {
    if (current_ == nullptr || row.repetition != current_->trace.repetition ||
        row.executor != current_->trace.executor)
      begin(std::string(row.executor), row.repetition);
    measures_->add(row.record);
  }
  void end() {
    if (current_ != nullptr) std::exchange(current_, nullptr)->measures = measures_->result();
  }
  void add(const ChainRow& row) {
    const auto repetition = all_.find({row.executor, row.repetition});
    if (repetition == all_.end()) run_.refuse_chain(row);
    std::vector<ChainRecord>& chains = repetition->second.trace.chains;
    chains.push_back(row.record);
    // run.json has only the sum of the drops; it is assigned to the first output.
    std::uint64_t& left = drops_[{row.executor, row.repetition}][run_.chains()[row.record.chain]];
    chains.back().dropped = static_cast<std::uint32_t>(std::exchange(left, 0));
  }

  /// By executor of run.json.
  [[nodiscard]] std::vector<ExecutorRuns> by_executor() && {
    std::vector<ExecutorRuns> runs;
    for (const std::string& executor : run_.executors()) {
      std::vector<Repetition>& own = runs.emplace_back(ExecutorRuns{executor, {}}).repetitions;
      for (auto& [key, repetition] : all_)
        if (key.first == executor) own.push_back(std::move(repetition));
    }
    return runs;
  }

 private:
  void begin(const std::string& executor, std::uint32_t number) {
    end();
    const RepetitionRecord& stored = run_.run(executor, number);
    if (std::ranges::count(run_.executors(), executor) == 0)
      run_.fail("its run.json does not name the executor " + executor);
    current_ = &all_[{executor, number}];
    drops_[{executor, number}] = stored.hot_path_drops;
    current_->usage = stored.usage;
    current_->trace.executor = executor;
    current_->trace.repetition = number;
    current_->trace.lost_records = stored.lost_records;
    // jobs.csv lacks the end of the run. An interrupted live run was shorter than planned; a
    // simulation has no wall time.
    current_->trace.end = Time{} + run_.length_of(stored.usage);
    const TaskSet& set = run_.tasks();
    run_.check([&] {
      for (TaskId id = 0; id < set.size(); ++id)
        current_->expected.push_back(stored.expected_of(set[id].name));
    });
    measures_.emplace(set, Time{} + warm_up_, current_->trace.end);
  }

  const StoredRun& run_;
  const Duration warm_up_;
  std::map<Key, Repetition> all_;
  std::map<Key, std::map<std::string, std::uint64_t>> drops_;  // not yet assigned, by chain
  Repetition* current_ = nullptr;
  std::optional<JobMeasures> measures_;  // of the current repetition
};

/// Samples by repetition and name, in the order of their first ones.
struct SampleTable {
  /// Where those of a row belong.
  nlohmann::json& of(const auto& row, const std::string& name) {
    const std::string executor(row.executor);
    const auto [at, added] = places.try_emplace({executor, row.repetition, name}, rows.size());
    if (!added) return rows[at->second];
    static_cast<void>(run.run(executor, row.repetition));  // throws: it did not run
    rows.push_back({{"name", name}, {"executor", executor}, {"repetition", row.repetition}});
    return rows.back();
  }

  const StoredRun& run;
  SampleRows rows = {};
  std::map<std::tuple<std::string, std::uint32_t, std::string>, std::size_t> places = {};
};

}  // namespace

void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use) {
  std::ifstream in = run.open("jobs.csv");
  const std::string file = (run.folder() / "jobs.csv").string();
  std::set<std::pair<std::string, std::uint32_t>> seen;
  std::pair<std::string, std::uint32_t> last;
  for_each_record(in, run.tasks(), file, [&](const JobRow& row) {
    if (seen.empty() || row.repetition != last.second || row.executor != last.first) {
      last = std::pair(std::string(row.executor), row.repetition);
      if (!seen.insert(last).second)
        throw InputError(
            file, static_cast<std::int64_t>(row.line),
            program::concat("rows of ", last.first, ", repetition ", last.second, ", have ended before"),
            "keep the rows of a repetition together");
    }
    use(row);
  });
}

Summary summarize(const StoredRun& run, const SummaryOptions& options) {
  Repetitions repetitions(run, options.warm_up);
  for_each_record(run, [&](const JobRow& row) { repetitions.add(row); });
  repetitions.end();
  run.for_each_chain([&](const ChainRow& row) { repetitions.add(row); });
  Summary summary = summarize(run.tasks(), std::move(repetitions).by_executor(), options);
  for (const RepetitionRecord& r : run.record().runs) {
    const auto executor = std::ranges::find(summary.executors, r.executor, &ExecutorSummary::executor);
    if (run.record().simulation && executor != summary.executors.end()) executor->overload = r.failure;
  }
  return summary;
}

SampleRows chain_samples(const StoredRun& run) {
  SampleTable all{run};
  run.for_each_chain(
      [&](const ChainRow& row) { add(all.of(row, run.chains()[row.record.chain]), row.record); });
  return std::move(all.rows);
}

SampleRows response_samples(const StoredRun& run) {
  SampleTable all{run};
  for_each_record(run, [&](const JobRow& row) {
    if (!counts(row.record, Time{} + run.warm_up())) return;
    nlohmann::json& samples = all.of(row, run.tasks()[row.record.job.task].name);
    samples["response_ms"].push_back(to_ms(row.record.response_time()));
  });
  return std::move(all.rows);
}

void add(nlohmann::json& samples, const ChainRecord& output) {
  const auto age = output.latency(Latency::age);
  samples["hot_path_ms"].push_back(to_ms(output.hot_path_latency));
  samples["age_ms"].push_back(age ? nlohmann::json(to_ms(*age)) : nlohmann::json());
}

RepeatedSamples resampled(std::vector<std::vector<double>> repetitions, bool exact) {
  if (repetitions.size() != 1 || exact || repetitions[0].size() < kLeastForBlocks)
    return RepeatedSamples(std::move(repetitions));
  std::vector<std::vector<double>> blocks;
  const std::size_t size = repetitions[0].size();
  for (auto begin = repetitions[0].begin(); blocks.size() < kBlocks;) {
    const auto end = begin + static_cast<std::ptrdiff_t>(size / kBlocks + (blocks.size() < size % kBlocks));
    blocks.emplace_back(std::exchange(begin, end), end);
  }
  return RepeatedSamples(std::move(blocks));
}

nlohmann::json curve_of(const RepeatedSamples& samples) {
  const std::vector<double> q = probabilities(samples.pooled().size());
  nlohmann::json curve = {{"n", samples.pooled().size()}, {"q", q}};
  for (const Estimate& e : estimate_quantiles(samples, q)) {
    curve["value"].push_back(rounded(e.value, 1e6));
    curve["low"].push_back(e.interval ? nlohmann::json(rounded(e.interval->low, 1e6)) : nlohmann::json());
    curve["high"].push_back(e.interval ? nlohmann::json(rounded(e.interval->high, 1e6)) : nlohmann::json());
  }
  return curve;
}

}  // namespace hotpath::results
