// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/golden_trace.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/timer.hpp"

namespace hotpath {

namespace {

constexpr char kHeaderMark = '#';

/// Parses a header line.
Task read_task(const LineReader& line) {
  std::istringstream words(std::string(line.text().substr(1)));
  Task task;
  std::string keys[3];
  std::int64_t period = 0, wcet = 0, first = 0;
  words >> task.name >> keys[0] >> period >> keys[1] >> wcet >> keys[2] >> first;
  const bool too_long = Duration(std::max({period, wcet, first})) > kLongest;
  if (!words || keys[2] != "first_release_ns" || period <= 0 || wcet < 0 || first < 0 || too_long) {
    throw InputError(line.file(), static_cast<std::int64_t>(line.line()),
                     "the header line of a golden trace is malformed",
                     "give `# TASK period_ns N wcet_ns N first_release_ns N`");
  }
  task.period = task.deadline = Duration(period);
  task.wcet = task.bcet = Duration(wcet);
  task.phase = Duration(first);
  return task;
}

/// Sets the next calls of polled timers, which are called when their jobs start.
void call_timers(GoldenTrace& trace) {
  std::vector<Timer> timers;
  for (TaskId id = 0; id < trace.set.size(); ++id) timers.emplace_back(id, trace.set[id], Time{});
  for (GoldenJob& job : trace.jobs) {
    timers[job.task].call(job.start);
    job.next_call = timers[job.task].next_call();
  }
}

}  // namespace

bool is_golden_trace(std::string_view first_line) { return first_line.starts_with(kHeaderMark); }

GoldenTrace read_golden_trace(const std::filesystem::path& file) {
  std::ifstream in = open_input(file, "give a readable golden trace");
  GoldenTrace trace;
  std::map<std::string, TaskId, std::less<>> ids;
  LineReader lines(in, file.string());
  while (in.peek() == kHeaderMark && lines.next()) {
    trace.set.tasks.push_back(read_task(lines));
    Task& task = trace.set.tasks.back();
    task.group = ids[task.name] = trace.set.size() - 1;
    trace.set.groups.resize(trace.set.size(), CallbackGroup::mutually_exclusive);
  }
  if (trace.set.tasks.empty()) {
    throw InputError(file.string(), 1, "the file is not a golden trace",
                     "begin with a line `# TASK ...` for each task");
  }
  CsvReader jobs(std::move(lines), CsvLayout::written,
                 {"task", "count", "start_ns", "finish_ns", "next_call_ns"});
  if (jobs.header().size() < 5) {
    jobs.fail("the rows of a golden trace have at least five fields",
              "give task, count, start, finish, and next call or thread");
  }
  const bool has_worker = jobs.find_column("thread").has_value();
  while (jobs.next()) {
    const auto id = ids.find(jobs.text(0));
    if (id == ids.end())
      jobs.fail(concat("task ", jobs.text(0), " is not in the header"), "give it a line `# TASK ...`");
    const auto instant = [&](std::size_t column) { return Time{} + jobs.nanoseconds(column); };
    GoldenJob job{id->second, jobs.number<std::uint64_t>(1), instant(2), instant(3), {}, 0};
    if (job.count > static_cast<std::uint64_t>(kLongest / trace.set[job.task].period)) {
      jobs.fail(concat("job ", job.count, " would be released after more than 36 years"),
                "give the number of earlier jobs of the task");
    }
    if (has_worker) {
      job.worker = jobs.number<Worker>(4);
    } else {
      job.next_call = instant(4);
    }
    trace.jobs.push_back(job);
  }
  std::stable_sort(trace.jobs.begin(), trace.jobs.end(),
                   [](const GoldenJob& a, const GoldenJob& b) { return a.start < b.start; });
  if (has_worker) call_timers(trace);
  return trace;
}

double similarity(const JobOrder& a, const JobOrder& b) {
  if (a.empty() && b.empty()) return 1;
  std::vector<std::uint32_t> above(b.size() + 1), row(b.size() + 1);
  for (const TaskId task : a) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = task == b[j] ? above[j] + 1 : std::max(above[j + 1], row[j]);
    }
    std::swap(above, row);
  }
  return 2.0 * above.back() / static_cast<double>(a.size() + b.size());
}

JobOrder by_period(JobOrder order, const TaskSet& set) {
  for (TaskId& id : order) {
    for (TaskId first = 0; first < id; ++first) {
      if (set[first].kind == set[id].kind && set[first].period == set[id].period) id = first;
    }
  }
  return order;
}

}  // namespace hotpath
