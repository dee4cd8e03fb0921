// SPDX-License-Identifier: Apache-2.0
#include "page/stored_jobs.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "results/stored_summary.hpp"

namespace hotpath::page {

using nlohmann::json;

namespace {

Intervals merged(Intervals intervals) {
  std::ranges::sort(intervals);
  Intervals disjoint;
  for (const auto& [from, to] : intervals) {
    if (!disjoint.empty() && from <= disjoint.back().second) {
      disjoint.back().second = std::max(disjoint.back().second, to);
    } else {
      disjoint.emplace_back(from, to);
    }
  }
  return disjoint;
}

}  // namespace

PageJob job_row(const JobRecord& r) {
  return {r.job.task,
          static_cast<std::int64_t>(r.job.sequence),
          r.start.time_since_epoch().count(),
          r.outcome == Outcome::ran ? r.duration().count() : -1,
          r.lateness().count(),
          (r.start - r.job.release).count(),
          r.worker};
}

std::size_t count_jobs(const results::StoredRun& run) {
  if (!std::filesystem::exists(run.folder() / "jobs.csv")) return 0;
  std::size_t jobs = 0;
  results::for_each_record(run, [&](const JobRow& row) { jobs += row.record.started(); });
  return jobs;
}

ShownJobs shown_jobs(const results::StoredRun& run, std::size_t all, std::size_t most,
                     WantedIntervals wanted) {
  struct Repetition {
    std::string executor;
    std::uint32_t number;
    Intervals kept;
    Time first_left_out = kNever;
    std::array<std::vector<std::int64_t>, std::tuple_size_v<PageJob>> jobs{};
    std::int64_t last_start = 0;
    std::map<TaskId, std::int64_t> last_sequence{};
  };
  ShownJobs shown;
  std::vector<Repetition> repetitions;
  std::map<std::string, std::size_t> first;  // jobs kept outside of wanted intervals, by executor
  results::for_each_record(run, [&](const JobRow& row) {
    const JobRecord& job = row.record;
    if (repetitions.empty() || repetitions.back().number != row.repetition ||
        repetitions.back().executor != row.executor) {
      const std::string executor(row.executor);
      repetitions.push_back({executor, row.repetition, wanted[{executor, row.repetition}]});
    }
    if (!job.started()) return;
    ++shown.started;
    Repetition& of = repetitions.back();
    const auto is_around = [&](const auto& i) { return i.first <= job.start && job.start < i.second; };
    if (all > most && (shown.kept >= most || std::ranges::none_of(of.kept, is_around)) &&
        ++first[of.executor] > most * 9 / 10 / run.executors().size()) {
      of.first_left_out = std::min(of.first_left_out, job.start);
      return;
    }
    ++shown.kept;
    PageJob numbers = job_row(job);
    numbers[1] -= std::exchange(of.last_sequence[job.job.task], numbers[1]);
    numbers[2] -= std::exchange(of.last_start, numbers[2]);
    for (std::size_t n = 0; n < numbers.size(); ++n) of.jobs[n].push_back(numbers[n]);
  });
  for (Repetition& of : repetitions) {
    const Duration length = run.length_of(run.run(of.executor, of.number).usage);
    of.kept.emplace_back(Time{}, std::min(Time{} + length, of.first_left_out));
    json kept_ns = json::array();
    for (const auto& [from, to] : merged(std::move(of.kept)))
      kept_ns.push_back({from.time_since_epoch().count(), to.time_since_epoch().count()});
    shown.repetitions.push_back({{"executor", of.executor},
                                 {"repetition", of.number},
                                 {"length_ns", length.count()},
                                 {"kept_ns", kept_ns},
                                 {"jobs", of.jobs}});
  }
  return shown;
}

}  // namespace hotpath::page
