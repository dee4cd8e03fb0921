// SPDX-License-Identifier: Apache-2.0
#include "validation/schedule_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "program/errors.hpp"

namespace hotpath {

namespace {

using Sequence = std::vector<TaskId>;

/// Jobs whose order is compared: the time for it grows with their square.
constexpr std::size_t kMostCompared = 10000;

Sequence sequence(const Schedule& schedule, Time until) {
  Sequence tasks;
  for (const ExecutedJob& job : schedule.jobs) {
    if (job.start <= until) tasks.push_back(job.task);
  }
  return tasks;
}

Sequence by_period(Sequence tasks, const TaskSet& set) {
  for (TaskId& id : tasks) {
    for (TaskId first = 0; first < id; ++first) {
      if (set[first].kind == set[id].kind && set[first].period == set[id].period) id = first;
    }
  }
  return tasks;
}

double similarity(const Sequence& a, const Sequence& b) {
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

double lost_percent(const Sequence& tasks, const Task& task, TaskId id, Time until) {
  if (until < Time{} + task.phase) return 0;
  const auto timestamps = 1 + (until - Time{} - task.phase) / task.period;
  const auto executed = std::count(tasks.begin(), tasks.end(), id);
  return 100 * std::max(0.0, 1 - static_cast<double>(executed) / static_cast<double>(timestamps));
}

void measure(const Schedule& schedule, Time until, Quantiles& lateness, Quantiles& response,
             Quantiles& authors) {
  std::vector<double> late, responses, as_authors;
  for (const ExecutedJob& job : schedule.jobs) {
    if (job.start > until || !job.finished()) continue;
    late.push_back(to_ms(job.start - job.timestamp));
    responses.push_back(to_ms(response_time(job)));
    if (job.next_call != kNever) as_authors.push_back(to_ms(response_authors(schedule, job)));
  }
  lateness = quantiles(std::move(late));
  response = quantiles(std::move(responses));
  authors = quantiles(std::move(as_authors));
}

}  // namespace

Schedule read_golden_trace(const std::filesystem::path& file, bool release_only) {
  std::ifstream in(file);
  if (!in) throw UsageError("the golden trace " + file.string() + " cannot be read");
  Schedule schedule;
  std::map<std::string, TaskId> ids;
  std::vector<std::uint64_t> counts;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto bad = [&](const std::string& right) {
      throw UsageError(file.string() + ":" + std::to_string(number) + ": this is no golden trace; " + right);
    };
    std::string key, name;
    if (line.starts_with('#')) {
      std::istringstream words(line.substr(1));
      std::int64_t period = 0, wcet = 0, phase = 0;
      if (!(words >> name >> key >> period >> key >> wcet >> key >> phase) || period <= 0) {
        bad("a header line reads `# TASK period_ns N wcet_ns N first_release_ns N`");
      }
      Task& task = schedule.set.tasks.emplace_back();
      task.name = name;
      task.period = task.deadline = Duration(period);
      task.wcet = task.bcet = Duration(wcet);
      task.phase = Duration(phase);
      ids[name] = schedule.set.size() - 1;
      counts.push_back(0);
      continue;
    }
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::int64_t count = 0, start = 0, end = 0, next = 0;
    if (!(words >> name >> count >> start >> end >> next)) {
      bad("a job reads `task,count,start_ns,end_ns,next_call_ns`");
    }
    const auto id = ids.find(name);
    if (id == ids.end()) bad("task " + name + " is not in its header");
    const Task& task = schedule.set[id->second];
    const auto before = static_cast<std::int64_t>(counts[id->second]++);
    schedule.jobs.push_back({id->second, Time{} + task.phase + before * task.period, from_ns(start),
                             from_ns(end), from_ns(next)});
  }
  sort_by_start(schedule.jobs);
  if (!release_only) {
    std::vector<Time> next_call;
    for (const Task& task : schedule.set.tasks) next_call.push_back(Time{} + task.phase);
    for (ExecutedJob& job : schedule.jobs) {
      job.timestamp = std::exchange(next_call[job.task], job.next_call);
    }
  }
  return schedule;
}

double ScheduleComparison::largest_loss_difference() const {
  double largest = 0;
  for (const TaskComparison& t : tasks) {
    largest = std::max(largest, std::abs(t.lost_percent[0] - t.lost_percent[1]));
  }
  return largest;
}

ScheduleComparison compare(const Schedule& measured, const Schedule& predicted) {
  ScheduleComparison c;
  if (measured.jobs.empty() || predicted.jobs.empty()) return c;
  const Time until =
      std::min(measured.jobs.back().start, predicted.jobs.back().start) + std::chrono::milliseconds(1);
  Sequence a = sequence(measured, until), b = sequence(predicted, until);
  c.jobs[0] = a.size();
  c.jobs[1] = b.size();
  const auto [in_a, in_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  if (in_a != a.end() && in_b != b.end()) {
    const auto place = static_cast<std::size_t>(in_a - a.begin());
    c.first_difference = {
        place, measured.jobs[place].start, {measured.set[*in_a].name, measured.set[*in_b].name}};
  }
  for (TaskId id = 0; id < measured.set.size(); ++id) {
    const Task& task = measured.set[id];
    if (task.kind != TaskKind::timer) continue;
    c.tasks.push_back({task.name, {lost_percent(a, task, id, until), lost_percent(b, task, id, until)}});
  }
  a.resize(std::min(a.size(), kMostCompared));
  b.resize(std::min(b.size(), kMostCompared));
  c.similarity = similarity(a, b);
  c.similarity_by_period = similarity(by_period(a, measured.set), by_period(b, measured.set));
  measure(measured, until, c.lateness_ms[0], c.response_ms[0], c.response_authors_ms[0]);
  measure(predicted, until, c.lateness_ms[1], c.response_ms[1], c.response_authors_ms[1]);
  return c;
}

}  // namespace hotpath
