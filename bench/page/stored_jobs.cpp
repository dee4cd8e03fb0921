// SPDX-License-Identifier: Apache-2.0
#include "page/stored_jobs.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "results/stored_summary.hpp"

namespace hotpath::page {

using nlohmann::json;

namespace {

std::vector<Interval> merged(std::vector<Interval> intervals) {
  std::ranges::sort(intervals);
  std::vector<Interval> disjoint;
  for (const auto& [from, to] : intervals) {
    if (!disjoint.empty() && from <= disjoint.back().second) {
      disjoint.back().second = std::max(disjoint.back().second, to);
    } else {
      disjoint.emplace_back(from, to);
    }
  }
  return disjoint;
}

json intervals_json(const std::vector<Interval>& intervals) {
  json all = json::array();
  for (const auto& [from, to] : intervals) {
    all.push_back({from.time_since_epoch().count(), to.time_since_epoch().count()});
  }
  return all;
}

}  // namespace

void JobColumns::add(const JobRecord& r) {
  const auto difference = [](std::uint64_t a, std::uint64_t b) { return static_cast<std::int64_t>(a - b); };
  const bool published = r.job.parent.task != kNoTask;
  columns_.add({r.job.task, difference(r.job.sequence, last_sequence_[r.job.task]),
                (r.start - last_start_).count(), r.outcome == Outcome::ran ? r.duration().count() : -1,
                r.lateness().count(), (r.start - r.job.release).count(), r.worker,
                published ? static_cast<std::int64_t>(r.job.parent.task) : -1,
                published ? difference(r.job.sequence, r.job.parent.sequence) : 0});
  last_sequence_[r.job.task] = r.job.sequence;
  last_start_ = r.start;
}

std::size_t count_jobs(const results::StoredRun& run) {
  if (!std::filesystem::exists(run.folder() / "jobs.csv")) return 0;
  std::size_t jobs = 0;
  results::for_each_record(run, [&](const JobRow& row) { jobs += row.record.started(); });
  return jobs;
}

StoredJobs::StoredJobs(const results::StoredRun& run, std::size_t all, std::size_t most,
                       WantedIntervals wanted)
    : run_(run), most_(most) {
  results::for_each_record(run, [&](const JobRow& row) {
    if (repetitions_.empty() || repetitions_.back().repetition != row.repetition ||
        repetitions_.back().executor != row.executor) {
      begin(std::string(row.executor), row.repetition, wanted);
    }
    if (!row.record.started()) return;
    ++started_;
    if (all > most_ && !keeps(repetitions_.back(), row.record)) return;
    ++kept_;
    repetitions_.back().jobs.add(row.record);
  });
}

void StoredJobs::begin(const std::string& executor, std::uint32_t repetition, WantedIntervals& wanted) {
  repetitions_.push_back({executor, repetition, JobColumns(run_.tasks().size()),
                          merged(std::move(wanted[{executor, repetition}])), kNever});
}

bool StoredJobs::keeps(OfRepetition& of, const JobRecord& job) {
  const auto is_around = [&](const Interval& i) { return i.first <= job.start && job.start < i.second; };
  if (kept_ < most_ && std::ranges::any_of(of.wanted, is_around)) return true;
  std::size_t& first = first_[of.executor];
  if (first < most_ * 9 / 10 / run_.executors().size()) {
    ++first;
    return true;
  }
  of.first_left_out = std::min(of.first_left_out, job.start);
  return false;
}

std::vector<Interval> StoredJobs::kept_intervals(const OfRepetition& of, Time end) const {
  if (kept_ == started_) return {{Time{}, end}};
  std::vector<Interval> kept = of.wanted;
  if (of.first_left_out > Time{}) kept.emplace_back(Time{}, std::min(end, of.first_left_out));
  return merged(std::move(kept));
}

json StoredJobs::repetitions() const {
  json all = json::array();
  for (const OfRepetition& of : repetitions_) {
    const Duration length = run_.length_of(run_.run(of.executor, of.repetition).usage);
    all.push_back({{"executor", of.executor},
                   {"repetition", of.repetition},
                   {"length_ns", length.count()},
                   {"kept_ns", intervals_json(kept_intervals(of, Time{} + length))},
                   {"jobs", of.jobs.columns()}});
  }
  return all;
}

}  // namespace hotpath::page
