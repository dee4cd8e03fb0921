// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "hotpath/core/golden_trace.hpp"
#include "program/text.hpp"
#include "validation/validation.hpp"

namespace hotpath::validation {

namespace {

/// Least similarity that counts as agreement.
constexpr double kSimilar = 0.98;

/// Most jobs whose order is compared: the time grows with their square.
constexpr std::size_t kMostCompared = 10000;

JobOrder sequence(const results::Schedule& schedule, Time until) {
  JobOrder tasks;
  for (const results::ExecutedJob& job : schedule.jobs)
    if (job.start <= until) tasks.push_back(job.job.task);
  return tasks;
}

double lost_percent(const JobOrder& tasks, const Task& task, TaskId id, Time until) {
  const std::uint64_t timestamps = timestamps_in(task, Time{}, until + Duration(1));
  if (timestamps == 0) return 0;
  const auto executed = std::ranges::count(tasks, id);
  return 100 * std::max(0.0, 1 - static_cast<double>(executed) / static_cast<double>(timestamps));
}

/// One side of the comparison up to `until`. The phases in `set` decide the timestamps.
ScheduleSide side_of(const results::Schedule& schedule, const JobOrder& order, const TaskSet& set,
                     Time until) {
  std::vector<double> late, responses, as_authors;
  for (const results::ExecutedJob& job : schedule.jobs) {
    if (job.start > until || job.outcome != Outcome::ran) continue;
    late.push_back(to_ms(job.lateness()));
    responses.push_back(to_ms(job.response_time()));
    if (job.next_call != kNever) as_authors.push_back(to_ms(results::response_authors(schedule, job)));
  }
  ScheduleSide side{order.size(),
                    {},
                    quantiles(std::move(late)),
                    quantiles(std::move(responses)),
                    quantiles(std::move(as_authors))};
  for (const TaskId id : set.timers())
    side.lost_percent[set[id].name] = lost_percent(order, set[id], id, until);
  return side;
}

}  // namespace

ScheduleComparison compare_schedules(const results::Schedule& measured, const results::Schedule& other) {
  ScheduleComparison c;
  if (measured.jobs.empty() || other.jobs.empty()) return c;
  const Time until =
      std::min(measured.jobs.back().start, other.jobs.back().start) + std::chrono::milliseconds(1);
  JobOrder a = sequence(measured, until), b = sequence(other, until);
  const auto [in_a, in_b] = std::ranges::mismatch(a, b);
  if (in_a != a.end() && in_b != b.end()) {
    const auto place = static_cast<std::size_t>(in_a - a.begin());
    c.first_difference = {place, to_ms(measured.jobs[place].start - Time{}), measured.set[*in_a].name,
                          measured.set[*in_b].name};
  }
  c.measured = side_of(measured, a, measured.set, until);
  c.other = side_of(other, b, measured.set, until);
  for (const auto& [timer, lost] : c.measured.lost_percent) {
    double& largest = c.largest_loss_difference_percent;
    largest = std::max(largest, std::abs(lost - c.other.lost_percent[timer]));
  }
  a.resize(std::min(a.size(), kMostCompared));
  b.resize(std::min(b.size(), kMostCompared));
  c.similarity = similarity(a, b);
  c.similarity_by_period = similarity(by_period(a, measured.set), by_period(b, measured.set));
  c.agrees = c.similarity >= kSimilar && c.largest_loss_difference_percent <= kSameLoss_percent;
  return c;
}

Quantiles real_latencies(const CsvReader& row) {
  Quantiles found{.n = row.number<std::size_t>("samples")};
  for (const QuantileTraits& of : kQuantiles)
    if (const auto column = row.find_column(program::concat("hot_path_", of.key, "_ms")))
      found.*of.of = row.number<double>(*column);
  return found;
}

nlohmann::json compare_latencies(const Quantiles& measured, std::vector<double> simulated_ms,
                                 double tolerance) {
  const Quantiles simulated = quantiles(std::move(simulated_ms));
  const double differs = measured.p50 == 0 ? kNoValue : 100 * (simulated.p50 / measured.p50 - 1);
  const bool agrees = std::abs(simulated.p50 - measured.p50) <= tolerance * measured.p50;
  return {{"measured_ms", measured},
          {"simulated_ms", simulated},
          {"median", {{"differs_percent", differs}, {"agrees", agrees}}}};
}

double largest_phase_difference_ms(const TaskSet& set, const std::vector<Duration>& first) {
  double largest = 0;
  for (TaskId id = 0; id < set.size(); ++id)
    largest = std::max(largest, std::abs(to_ms(set[id].phase - first[id])));
  return largest;
}

}  // namespace hotpath::validation
