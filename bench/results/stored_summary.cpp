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

/// The executor's position in run.json, and the repetition.
using RepetitionKey = std::pair<std::size_t, std::uint32_t>;

/// The place of an executor among those of run.json; behind all of them if it is not there.
std::size_t place_of(const StoredRun& run, std::string_view executor) {
  return static_cast<std::size_t>(std::ranges::find(run.executors(), executor) - run.executors().begin());
}

class StoredSummary {
 public:
  StoredSummary(const StoredRun& run, const SummaryOptions& options) : run_(run), options_(options) {
    for (const std::string& executor : run.executors()) {
      measures_.emplace_back(executor, run.tasks(), options_);
    }
  }

  void add(const JobRow& row) {
    if (!stored_ || row.repetition != current_.second || row.executor != executor().executor()) begin(row);
    accounts_[row.record.job.task].add(row.record);
    executor().add(row.record);
  }

  void end_repetition() {
    if (!stored_) return;
    const RepetitionRecord& stored = *std::exchange(stored_, nullptr);
    run_.check([&] {
      for (TaskAccount& a : accounts_) {
        a.expected = stored.expected_of(run_.tasks()[a.task].name);
      }
      executor().end(current_.second, current_.second, stored.usage, stored.lost_records, accounts_);
    });
  }

  void read_chains() {
    std::set<std::pair<RepetitionKey, std::uint32_t>> seen;
    run_.for_each_chain([&](const ChainRow& row) {
      const RepetitionKey key = {place_of(run_, row.executor), row.repetition};
      if (!repetitions_.contains(key)) run_.refuse_chain(row);
      ChainRecord record = row.record;
      // run.json has only the sum of the drops; it is assigned to the first output.
      if (seen.emplace(key, record.chain).second) record.dropped = drops(row);
      measures_[key.first].add(row.repetition, record);
    });
  }

  Summary finish() && {
    Summary summary{options_.warm_up, options_.bootstrap, {}};
    std::vector<std::vector<ChainSamples>> samples;  // by executor and chain
    for (ExecutorMeasures& m : measures_) {
      summary.executors.push_back(std::move(m).finish(samples.emplace_back()));
    }
    compare_with_baseline(summary, samples);
    for (const RepetitionRecord& r : run_.record().runs) {
      const auto executor = std::ranges::find(summary.executors, r.executor, &ExecutorSummary::executor);
      if (run_.record().simulation && executor != summary.executors.end()) executor->overload = r.failure;
    }
    return summary;
  }

 private:
  ExecutorMeasures& executor() { return measures_[current_.first]; }

  void begin(const JobRow& row) {
    end_repetition();
    current_ = {place_of(run_, row.executor), row.repetition};
    const std::string name(row.executor);
    stored_ = &run_.run(name, row.repetition);
    if (current_.first == measures_.size()) run_.fail("its run.json does not name the executor " + name);
    repetitions_.insert(current_);
    accounts_.assign(run_.tasks().size(), {});
    for (TaskId id = 0; id < accounts_.size(); ++id) accounts_[id].task = id;
    // jobs.csv lacks the end of the run. An interrupted live run was shorter than planned; a
    // simulation has no wall time.
    executor().begin(Time{}, Time{} + run_.length_of(stored_->usage));
  }

  std::uint32_t drops(const ChainRow& row) const {
    const auto& drops = run_.run(row.executor, row.repetition).hot_path_drops;
    const auto of_chain = drops.find(run_.chains()[row.record.chain]);
    return of_chain == drops.end() ? 0 : static_cast<std::uint32_t>(of_chain->second);
  }

  const StoredRun& run_;
  const SummaryOptions& options_;
  std::vector<ExecutorMeasures> measures_;
  std::set<RepetitionKey> repetitions_;
  RepetitionKey current_;
  const RepetitionRecord* stored_ = nullptr;  // the current repetition
  std::vector<TaskAccount> accounts_;
};

}  // namespace

void for_each_record(const StoredRun& run, const std::function<void(const JobRow&)>& use) {
  std::ifstream in = run.open("jobs.csv");
  const std::string file = (run.folder() / "jobs.csv").string();
  std::set<std::pair<std::string, std::uint32_t>> seen;
  std::string executor;
  std::uint32_t repetition = 0;
  for_each_record(in, run.tasks(), file, [&](const JobRow& row) {
    if (seen.empty() || row.repetition != repetition || row.executor != executor) {
      executor = row.executor;
      repetition = row.repetition;
      if (!seen.emplace(executor, repetition).second) {
        throw InputError(
            file, static_cast<std::int64_t>(row.line),
            program::concat("rows of ", executor, ", repetition ", repetition, ", have ended before"),
            "keep the rows of a repetition together");
      }
    }
    use(row);
  });
}

Summary summarize(const StoredRun& run, const SummaryOptions& options) {
  StoredSummary summary(run, options);
  for_each_record(run, [&](const JobRow& row) { summary.add(row); });
  summary.end_repetition();
  summary.read_chains();
  return std::move(summary).finish();
}

nlohmann::json responses(const StoredRun& run) {
  std::map<std::tuple<std::size_t, std::string, std::uint32_t>, nlohmann::json> all;  // by repetition
  const RepetitionRecord* current = nullptr;
  nlohmann::json* jobs = nullptr;  // of the current repetition
  for_each_record(run, [&](const JobRow& row) {
    if (current == nullptr || row.repetition != current->repetition || row.executor != current->executor) {
      current = &run.run(std::string(row.executor), row.repetition);
      jobs = &all[{place_of(run, row.executor), current->executor, current->repetition}];
      *jobs = {{"executor", row.executor},
               {"repetition", row.repetition},
               {"task", nlohmann::json::array()},
               {"ns", nlohmann::json::array()}};
    }
    if (!counts(row.record, Time{} + run.warm_up())) return;
    (*jobs)["task"].push_back(row.record.job.task);
    (*jobs)["ns"].push_back(row.record.response_time().count());
  });
  nlohmann::json document = {{"tasks", nlohmann::json::array()}, {"repetitions", nlohmann::json::array()}};
  for (const Task& task : run.tasks().tasks) document["tasks"].push_back(task.name);
  for (auto& [repetition, of_jobs] : all) document["repetitions"].push_back(std::move(of_jobs));
  return document;
}

}  // namespace hotpath::results
