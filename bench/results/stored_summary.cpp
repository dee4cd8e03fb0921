// SPDX-License-Identifier: Apache-2.0
#include "results/stored_summary.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "program/text.hpp"
#include "results/executor_measures.hpp"

namespace hotpath::results {

namespace {

/// The executor's position in run.json, and the repetition.
using RepetitionKey = std::pair<std::size_t, std::uint32_t>;

class StoredSummary {
 public:
  StoredSummary(const StoredRun& run, const SummaryOptions& options) : run_(run), options_(options) {
    for (const std::string& executor : run.executors()) {
      measures_.emplace_back(executor, run.tasks(), options_);
    }
  }

  void add(const JobRow& row) {
    if (!stored_ || row.repetition != current_.second || row.executor != executor().executor()) begin(row);
    auto& count = accounts_[row.record.job.task].count;
    ++count[static_cast<std::size_t>(row.record.outcome)];
    count[static_cast<std::size_t>(Outcome::skipped)] += row.record.job.skipped;
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
      const RepetitionKey key = {place_of(row.executor), row.repetition};
      if (!repetitions_.contains(key)) run_.refuse_chain(row);
      ChainRecord record = row.record;
      // run.json has only the sum of the drops; it is assigned to the first output.
      if (seen.emplace(key, record.chain).second) record.dropped = drops(row);
      measures_[key.first].add(row.repetition, record);
    });
  }

  Summary finish() && {
    Summary summary{options_.warm_up, options_.bootstrap, {}};
    std::vector<std::vector<RepeatedSamples>> hot_paths;  // by executor and chain
    for (ExecutorMeasures& m : measures_) {
      summary.executors.push_back(std::move(m).finish(hot_paths.emplace_back()));
    }
    compare_with_baseline(summary, hot_paths);
    return summary;
  }

 private:
  ExecutorMeasures& executor() { return measures_[current_.first]; }

  std::size_t place_of(std::string_view executor) const {
    const auto& all = run_.executors();
    return static_cast<std::size_t>(std::ranges::find(all, executor) - all.begin());
  }

  void begin(const JobRow& row) {
    end_repetition();
    current_ = {place_of(row.executor), row.repetition};
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

Summary summarize(const StoredRun& run, const SummaryOptions& options,
                  const std::function<void(const JobRow&)>& also) {
  StoredSummary summary(run, options);
  for_each_record(run, [&](const JobRow& row) {
    summary.add(row);
    also(row);
  });
  summary.end_repetition();
  summary.read_chains();
  return std::move(summary).finish();
}

ResponsesCsv::ResponsesCsv(std::ostream& out, const StoredRun& run) : out_(out), run_(run) {
  for (const RepetitionRecord& r : run.record().runs) {
    OfRepetition& of = repetitions_.emplace_back();
    of.executor = r.executor;
    of.repetition = r.repetition;
    of.seen = !r.failure.empty();  // no rows are written
  }
  std::ranges::sort(repetitions_, {}, [&](const OfRepetition& of) {
    return std::pair(std::ranges::find(run.executors(), of.executor), of.repetition);
  });
  out_ << "executor,repetition,task,response_ns\n";
}

void ResponsesCsv::add(const JobRow& row) {
  const auto is_of_row = [&](const OfRepetition& of) {
    return of.repetition == row.repetition && of.executor == row.executor;
  };
  if (current_ == repetitions_.size() || !is_of_row(repetitions_[current_])) {
    current_ = static_cast<std::size_t>(std::ranges::find_if(repetitions_, is_of_row) - repetitions_.begin());
    if (current_ == repetitions_.size()) {
      static_cast<void>(run_.run(std::string(row.executor), row.repetition));  // throws: it did not run
    }
    for (; next_ != current_ && next_ < repetitions_.size() && repetitions_[next_].seen; ++next_) {
      write_waiting(repetitions_[next_]);
    }
  }
  OfRepetition& of = repetitions_[current_];
  of.seen = true;
  if (!counts(row.record, Time{} + run_.warm_up())) return;
  const Response response{row.record.job.task, response_time(row.record).count()};
  current_ == next_ ? write(of, response) : of.waiting.push_back(response);
}

void ResponsesCsv::finish() {
  for (OfRepetition& of : repetitions_) write_waiting(of);
}

void ResponsesCsv::write(const OfRepetition& of, const Response& response) {
  program::write_row(out_, of.executor, of.repetition, run_.tasks()[response.task].name, response.ns);
}

void ResponsesCsv::write_waiting(OfRepetition& of) {
  for (const Response& response : of.waiting) write(of, response);
  of.waiting = {};
}

}  // namespace hotpath::results
