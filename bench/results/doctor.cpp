// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "hotpath/core/input_file.hpp"
#include "hotpath/core/schedule_check.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/run_folder.hpp"
#include "results/stored_summary.hpp"

namespace hotpath::results {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

class RunCheck {
 public:
  explicit RunCheck(const StoredRun& run)
      : run_(run), file_((run.folder() / "jobs.csv").string()), set_(run.tasks()) {
    for (const RepetitionRecord& r : run.record().runs)
      if (r.failure.empty()) done_[{r.executor, r.repetition}] = false;
  }

  CheckedRun check(std::istream& rows) {
    for_each_job(rows, run_.tasks(), file_, [this](const JobRow& row) { add(row); });
    end_repetition();
    for (const auto& [repetition, done] : done_) {
      if (done) continue;
      begin_repetition(repetition);
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
    if (const std::string violation = schedule_->add(row.record); !violation.empty())
      fail(row.line, violation);
  }

  void begin_repetition(const Key& repetition) {
    current_ = repetition;
    const auto known = done_.find(repetition);
    if (known == done_.end()) fail(line_, "run.json names no such repetition");
    if (std::exchange(known->second, true)) fail(line_, "rows of this repetition have ended before");
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
  TaskSet set_;               // with the phases of the current repetition
  std::map<Key, bool> done_;  // the repetitions that run.json names
  Key current_;
  std::optional<ScheduleCheck> schedule_;  // of the current repetition
  std::uint64_t rows_ = 0;
  std::size_t line_ = 1, last_line_ = 1;
};

/// Copies the header and the rows that begin with `EXECUTOR,REPETITION,` of `kept`. Ignores an incomplete
/// last line.
void copy_rows(const fs::path& from, const std::set<std::string>& kept, std::ostream& out) {
  std::ifstream in = open_input(from, "remove the file to recover the others");
  std::string line;
  for (bool header = true; std::getline(in, line) && !in.eof(); header = false) {
    const std::size_t end = line.find(',', line.find(',') + 1);
    if (header || (end != std::string::npos && kept.contains(line.substr(0, end + 1)))) out << line << '\n';
  }
  if (!in.eof()) out.setstate(std::ios::badbit);
}

/// Gives the files of the killed run their names, with the finished repetitions, and removes the temporary
/// files of an interrupted replacement.
void finish_files(const StoredRun& killed, const fs::path& folder) {
  std::set<std::string> kept;
  for (const RepetitionRecord& r : killed.record().runs)
    if (r.failure.empty()) kept.insert(program::concat(r.executor, ",", r.repetition, ","));
  if (kept.empty()) killed.fail("the run was killed before its first repetition ended; run it again");
  for (const char* name : {"jobs.csv", "chains.csv"}) {
    const fs::path whole = folder / name, grown = whole.string() + ".part";
    if (!fs::exists(grown)) continue;  // killed after the file was renamed
    program::write_whole_file(whole, [&](std::ostream& out) { copy_rows(grown, kept, out); });
    fs::remove(grown);
  }
  std::vector<fs::path> unfinished;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    for (const char* file : {".run.json.", ".summary.json.", ".jobs.csv.", ".chains.csv."})
      if (name.starts_with(file) && name.ends_with(".part")) unfinished.push_back(entry.path());
  }
  for (const fs::path& file : unfinished) fs::remove(file);
}

}  // namespace

CheckedRun check_run(const fs::path& folder) {
  const StoredRun run(folder, "doctor");
  std::ifstream rows = run.open("jobs.csv");
  return run.check([&] { return RunCheck(run).check(rows); });
}

Summary recover_run(const fs::path& folder) {
  StoredRun killed(folder, "doctor --recover");
  // A run records its end last: if killed just before, it has all files but no recorded end.
  const RunRecord& before = killed.record();
  const bool ended = before.complete || before.partial || !before.failures.empty();
  const bool grows = fs::exists(folder / "jobs.csv.part") || fs::exists(folder / "chains.csv.part");
  if (ended && !grows && fs::exists(folder / "summary.json")) {
    killed.fail("nothing to recover: its results are complete; `hotpath report --summary` reads them");
  }
  const int lock = RunFolder::lock(folder);
  if (lock < 0 && fs::exists(folder / "jobs.csv.part"))
    killed.fail("the run is still running; end it with Ctrl-C");
  finish_files(killed, folder);
  if (lock >= 0) close(lock);

  const StoredRun run(folder, "doctor --recover");
  Summary summary = summarize(run, run.summary_options());
  program::write_whole_file(folder / "summary.json", json(summary));
  RunRecord record = run.record();
  record.partial = true;
  record.warnings.emplace_back("The run was killed: its finished repetitions were recovered.");
  program::write_whole_file(folder / "run.json", json(record));
  return summary;
}

}  // namespace hotpath::results
