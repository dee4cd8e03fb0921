// SPDX-License-Identifier: Apache-2.0
#include "results/stored_summary.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "program/text.hpp"
#include "results/executor_measures.hpp"

namespace hotpath::results {

namespace {

/// The place of an executor among those of run.json; behind all of them if it is not there.
std::size_t place_of(const StoredRun& run, std::string_view executor) {
  return static_cast<std::size_t>(std::ranges::find(run.executors(), executor) - run.executors().begin());
}

class StoredSummary {
 public:
  StoredSummary(const StoredRun& run, const SummaryOptions& options) : run_(run) {
    for (const std::string& executor : run.executors()) all_.emplace_back(executor, run.tasks(), options);
  }

  void add(const JobRow& row) {
    if (stored_ == nullptr || row.repetition != stored_->repetition || row.executor != stored_->executor)
      begin(row);
    accounts_[row.record.job.task].add(row.record);
    all_[executor_].add(row.record);
  }

  void end_repetition() {
    if (stored_ == nullptr) return;
    const RepetitionRecord& stored = *std::exchange(stored_, nullptr);
    run_.check([&] {
      for (TaskAccount& a : accounts_) a.expected = stored.expected_of(run_.tasks()[a.task].name);
    });
    all_[executor_].end(stored.repetition, stored.usage, stored.lost_records, accounts_);
  }

  void add(const ChainRow& row) {
    const std::size_t executor = place_of(run_, row.executor);
    const auto drops = drops_.find({executor, row.repetition});
    if (drops == drops_.end()) run_.refuse_chain(row);
    ChainRecord record = row.record;
    // run.json has only the sum of the drops; it is assigned to the first output.
    std::uint64_t& left = drops->second[run_.chains()[record.chain]];
    record.dropped = static_cast<std::uint32_t>(std::exchange(left, 0));
    all_[executor].add(row.repetition, record);
  }

  std::vector<ExecutorMeasures> measures() && { return std::move(all_); }

 private:
  void begin(const JobRow& row) {
    end_repetition();
    const std::string name(row.executor);
    stored_ = &run_.run(name, row.repetition);
    executor_ = place_of(run_, name);
    if (executor_ == all_.size()) run_.fail("its run.json does not name the executor " + name);
    drops_[{executor_, row.repetition}] = stored_->hot_path_drops;
    accounts_.assign(run_.tasks().size(), {});
    for (TaskId id = 0; id < accounts_.size(); ++id) accounts_[id].task = id;
    // jobs.csv lacks the end of the run. An interrupted live run was shorter than planned; a
    // simulation has no wall time.
    all_[executor_].begin(Time{}, Time{} + run_.length_of(stored_->usage));
  }

  const StoredRun& run_;
  std::vector<ExecutorMeasures> all_;
  const RepetitionRecord* stored_ = nullptr;  // the current repetition
  std::size_t executor_ = 0;                  // of the current repetition
  std::vector<TaskAccount> accounts_;
  /// By executor and repetition, then by chain.
  std::map<std::pair<std::size_t, std::uint32_t>, std::map<std::string, std::uint64_t>> drops_;
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
      if (!seen.insert(last).second) {
        throw InputError(
            file, static_cast<std::int64_t>(row.line),
            program::concat("rows of ", last.first, ", repetition ", last.second, ", have ended before"),
            "keep the rows of a repetition together");
      }
    }
    use(row);
  });
}

Summary summarize(const StoredRun& run, const SummaryOptions& options) {
  StoredSummary stored(run, options);
  for_each_record(run, [&](const JobRow& row) { stored.add(row); });
  stored.end_repetition();
  run.for_each_chain([&](const ChainRow& row) { stored.add(row); });
  Summary summary = ExecutorMeasures::summary(std::move(stored).measures(), options);
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

}  // namespace hotpath::results
