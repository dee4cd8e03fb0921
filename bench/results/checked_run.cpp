// SPDX-License-Identifier: Apache-2.0
#include "results/stored_summary.hpp"

#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "hotpath/core/schedule_check.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::results {

namespace {

class RunCheck {
 public:
  explicit RunCheck(const StoredRun& run)
      : run_(run), file_((run.folder() / "jobs.csv").string()), set_(run.tasks()) {
    for (const RepetitionRecord& r : run.record().runs) {
      if (r.failure.empty()) named_.emplace(r.executor, r.repetition);
    }
  }

  CheckedRun check(std::istream& rows) {
    for_each_job(rows, run_.tasks(), file_, [this](const JobRow& row) { add(row); });
    end_repetition();
    for (const auto& [executor, repetition] : named_) {
      if (done_.contains({executor, repetition})) continue;
      begin_repetition({executor, repetition});
      end_repetition();  // checks a repetition without rows
    }
    return {rows_, done_.size()};
  }

 private:
  using Key = std::pair<std::string, std::uint32_t>;

  void add(const JobRow& row) {
    line_ = row.line;
    ++rows_;
    if (!schedule_ || row.executor != current_.first || row.repetition != current_.second) {
      end_repetition();
      begin_repetition({std::string(row.executor), row.repetition});
    }
    last_line_ = row.line;
    if (const std::string violation = schedule_->add(row.record); !violation.empty()) {
      fail(row.line, violation);
    }
  }

  void begin_repetition(const Key& repetition) {
    current_ = repetition;
    if (!named_.contains(repetition)) fail(line_, "run.json names no such repetition");
    if (!done_.insert(repetition).second) fail(line_, "rows of this repetition have ended before");
    const auto first = run_.first_timestamps(set_, repetition.first, repetition.second);
    for (TaskId id = 0; id < set_.size(); ++id) set_.tasks[id].phase = first[id];
    const Duration length = run_.length_of(run_.run(repetition.first, repetition.second).usage);
    schedule_.emplace(set_, Time{}, Time{} + length, run_.record().kind == RunKind::live);
  }

  void end_repetition() {
    if (!schedule_) return;
    const RepetitionRecord& stored = run_.run(current_.first, current_.second);
    std::vector<std::uint64_t> by_task;
    for (const Task& task : set_.tasks) by_task.push_back(stored.expected_of(task.name));
    if (const std::string lost = schedule_->lost(by_task); !lost.empty()) fail(last_line_, lost);
    schedule_.reset();
  }

  [[noreturn]] void fail(std::size_t line, const std::string& violation) const {
    throw program::RunError(program::concat(file_, ":", line, ": ", current_.first, ", repetition ",
                                            current_.second, ": ", violation));
  }

  const StoredRun& run_;
  const std::string file_;
  TaskSet set_;  // with the phases of the current repetition
  std::set<Key> named_, done_;
  Key current_;
  std::optional<ScheduleCheck> schedule_;  // of the current repetition
  std::uint64_t rows_ = 0;
  std::size_t line_ = 1, last_line_ = 1;
};

}  // namespace

CheckedRun check_run(const std::filesystem::path& folder) {
  const StoredRun run(folder, "doctor");
  std::ifstream rows = run.open("jobs.csv");
  return run.check([&] { return RunCheck(run).check(rows); });
}

}  // namespace hotpath::results
