// SPDX-License-Identifier: Apache-2.0
#include "results/stored_run.hpp"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/registry.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/hash.hpp"
#include "program/json_record.hpp"
#include "program/memory_limit.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/measures.hpp"
#include "results/schedule.hpp"

namespace hotpath::results {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

std::string named(const std::string& executor, std::uint32_t repetition) {
  return program::concat(executor, " (repetition ", repetition, ")");
}

/// In traces or records.
auto find_repetition(auto& all, const std::string& executor, std::uint32_t repetition) {
  return std::ranges::find_if(
      all, [&](const auto& of) { return of.executor == executor && of.repetition == repetition; });
}

std::string hash_of(const std::string& content) {
  return program::text("%016llx", static_cast<unsigned long long>(program::hash_of(content)));
}

std::string content_of(std::ifstream in) {
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

StoredRun::StoredRun(fs::path folder, std::string option)
    : folder_(std::move(folder)), option_(std::move(option)) {
  std::ifstream in = open("run.json");
  check([&] { program::parse_shallow(in).get_to(record_); });
  if (record_.tasks.tasks.empty()) fail("its run.json has no tasks");
  tasks_ = record_.tasks;
}

std::ifstream StoredRun::open(const char* file) const {
  const std::string remedy =
      fs::exists(folder_ / "run" / file)  // of an import
          ? "give " + (folder_ / "run").string()
          : fs::exists(folder_ / (std::string(file) + ".part"))
                ? "if the run was killed, `hotpath doctor RUN --recover` saves what it has finished"
                : "give the folder of a complete run, as written by `hotpath run` or `simulate` without "
                  "--no-trace";
  try {
    return open_input(folder_ / file, remedy);
  } catch (const InputError& error) {
    throw program::UsageError(option_ + ": " + error.what());
  }
}

const auto& StoredRun::of_repetition(const auto& all, const std::string& executor,
                                     std::uint32_t repetition) const {
  const auto match = find_repetition(all, executor, repetition);
  if (match != all.end()) return *match;
  std::vector<std::string> runs;
  for (const RepetitionRecord& r : record_.runs) runs.push_back(named(r.executor, r.repetition));
  fail(named(executor, repetition) + " is not in this run; " +
       (runs.empty() ? "it has no repetitions" : "it has " + program::joined(runs)));
}

const RepetitionRecord& StoredRun::run(const std::string& executor, std::uint32_t repetition) const {
  return of_repetition(record_.runs, executor, repetition);
}

std::vector<Duration> StoredRun::first_timestamps(const TaskSet& set, const std::string& executor,
                                                  std::uint32_t repetition) const {
  const std::map<std::string, Duration>& stored = run(executor, repetition).first_timestamps;
  std::vector<Duration> first(set.size());
  const std::vector<TaskId> timers = set.timers();
  for (const TaskId id : timers) {
    const auto timestamp = stored.find(set[id].name);
    if (timestamp == stored.end())
      fail("it has no first timestamp for timer " + set[id].name + "; does it belong to another graph?");
    first[id] = timestamp->second;
  }
  if (timers.size() != stored.size())
    fail(program::concat("it has first timestamps for ", stored.size(), " timers, the graph has ",
                         timers.size(), "; does it belong to another graph?"));
  return first;
}

void StoredRun::load(const TaskSet& set) {
  tasks_ = set;
  constexpr double kShortRow = 100;  // bytes of jobs.csv
  std::error_code none;
  const auto size = static_cast<double>(fs::file_size(folder_ / "jobs.csv", none));
  if (!none) {
    program::check_trace_memory(size / kShortRow * sizeof(JobRecord), option_ + " " + folder_.string(),
                                "a shorter run, or a machine with more memory");
  }
  std::ifstream in = open("jobs.csv");
  traces_ = read_jobs_csv(in, tasks_, (folder_ / "jobs.csv").string());
  // Live repetitions are interleaved at random.
  std::ranges::sort(traces_, {}, [&](const Trace& t) {
    return std::pair(std::ranges::find(executors(), t.executor), t.repetition);
  });
  for_each_chain([&](const ChainRow& row) {
    const auto trace = find_repetition(traces_, row.executor, row.repetition);
    if (trace == traces_.end()) refuse_chain(row);
    trace->chains.push_back(row.record);
  });
}

void StoredRun::for_each_chain(const std::function<void(const ChainRow&)>& use) const {
  std::ifstream in = open("chains.csv");
  hotpath::for_each_chain(in, tasks_, chains(), (folder_ / "chains.csv").string(), use);
}

void StoredRun::refuse_chain(const ChainRow& row) const {
  throw InputError((folder_ / "chains.csv").string(), static_cast<std::int64_t>(row.line),
                   "jobs.csv has no such repetition of `" + row.executor + "`",
                   "the files do not belong to one run");
}

const Trace& StoredRun::trace(const std::string& executor, std::uint32_t repetition) const {
  return of_repetition(traces_, executor, repetition);
}

SummaryOptions StoredRun::summary_options() const { return {chains(), warm_up(), {.seed = record_.seed}}; }

void StoredRun::fail(const std::string& what) const {
  throw program::UsageError(option_ + " " + folder_.string() + ": " + what);
}

void keep_input(const RunFolder& folder, RunRecord& record, const std::string& kind, const fs::path& original,
                std::string name) {
  const std::string content = content_of(open_input(original, "it is an input of the run"));
  std::error_code ignored;
  const fs::path absolute = fs::absolute(original, ignored);
  if (name.empty()) name = program::concat("input_", kind, original.extension().string());
  program::create_folder((folder.path() / name).parent_path());
  folder.write(name, content);
  record.inputs.push_back({kind, name, absolute.lexically_normal(), hash_of(content)});
}

std::optional<fs::path> kept_input(const StoredRun& run, const std::string& kind) {
  const auto& inputs = run.record().inputs;
  const auto kept = std::ranges::find(inputs, kind, &InputRecord::kind);
  if (kept == inputs.end()) return std::nullopt;
  fs::path copy = run.folder() / fs::path(kept->file).filename();
  if (!fs::exists(copy)) run.fail("its file " + copy.string() + " is missing");
  static std::set<fs::path> warned;
  std::ifstream original(kept->original);
  if (original && hash_of(content_of(std::move(original))) != kept->hash && warned.insert(copy).second) {
    std::cerr << "warning: " << kept->original << " has changed since the run; its copy " << copy.string()
              << " is used\n";
  }
  return copy;
}

json summarize_golden_trace(const fs::path& file) {
  const GoldenTrace trace = read_golden_trace(file);
  // The executor decides how timestamps follow from next calls; the authors' response times need none.
  const std::string executor = file.stem().extension().string();  // with its dot
  const ExecutorEntry* const known = find_executor(executor.empty() ? executor : executor.substr(1));
  const Schedule schedule =
      schedule_of(trace, known != nullptr && known->traits.timers == TimerHandling::release_only);
  std::vector<TimerCounts> counts(trace.set.size());
  std::vector<Duration> longest(trace.set.size());
  for (const ExecutedJob& job : schedule.jobs) {
    const Task& task = trace.set[job.job.task];
    TimerCounts& of = counts[job.job.task];
    of.reached = static_cast<std::uint64_t>((job.next_call - Time{} - task.phase) / task.period);
    of.skipped = of.reached - ++of.ran;
    of.deadline_overruns += overruns_deadline(task, response_authors(schedule, job));
    longest[job.job.task] = std::max(longest[job.job.task], job.response_time());
  }
  json tasks = json::array();
  for (TaskId id = 0; id < trace.set.size(); ++id) {
    tasks.push_back(counts[id]);
    tasks.back().update({{"task", trace.set[id].name}, {"response_max_ms", to_ms(longest[id])}});
  }
  return {{"tasks", tasks}};
}

}  // namespace hotpath::results
