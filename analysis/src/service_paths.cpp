// SPDX-License-Identifier: Apache-2.0
#include "service_paths.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::ceil_div, exact::floor_div, exact::multiply, exact::subtract;

namespace {

constexpr std::int64_t kLongestDelay = std::int64_t{1} << 50;  // 13 days
constexpr int kMostDelays = 1000;
constexpr std::size_t kMostInstants = 100'000;
/// The number of steps to the end of a busy period grows without limit towards 1.
constexpr double kMostUtilisation = 0.9999;

std::optional<std::int64_t> sum(std::int64_t a, std::optional<std::int64_t> b) {
  return b ? std::optional(add(a, *b)) : std::nullopt;
}

class ServicePaths final : public PathBounds {
 public:
  ServicePaths(const GraphTopology& topology, const PathBounds& others, const GraphOverheads& overheads,
               std::int64_t wait)
      : topology_(topology), others_(others), overheads_(overheads) {
    std::int64_t longest = 0;
    for (TaskId id = 0; id < topology.size(); ++id) {
      if (!topology.roots(id).empty()) longest = std::max(longest, job_work(id));
    }
    const auto job = with_releases(longest);
    if (!job) return;
    step_ = add(wait, std::max(*job, overheads.wake_up));
    finishes_ = find_finishes();
  }

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override {
    const auto other = others_.until_start(root, to);
    if (!is_service(to) || !finishes_) return other;
    const auto request = published(root, to, *finishes_);
    if (!request) return other;
    return smaller(other, sum(add(*request, finishes_->delay), with_releases(overheads_.job)));
  }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override {
    return finishes_ ? finish(root, to, *finishes_) : others_.until_finish(root, to);
  }
  std::optional<std::int64_t> response(TaskId subscription) const override {
    const auto other = others_.response(subscription);
    if (!is_service(subscription) || !finishes_) return other;
    return smaller(other, sum(finishes_->delay, with_releases(job_work(subscription))));
  }
  // A job starts no earlier than at its timestamp.
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override {
    const auto other = others_.start_to_start(root, to), end = until_finish(root, to);
    return end && is_service(to) ? smaller(other, subtract(*end, topology_.set()[to].bcet.count())) : other;
  }
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override {
    const auto other = others_.start_to_finish(root, to);
    return is_service(to) ? smaller(other, until_finish(root, to)) : other;
  }
  std::optional<std::int64_t> later_start_to_start(TaskId root, TaskId to, TaskId other, TaskId input,
                                                   TaskId meets) const override {
    return others_.later_start_to_start(root, to, other, input, meets);
  }
  bool overtakes(TaskId root, TaskId to) const override { return others_.overtakes(root, to); }
  std::optional<std::int64_t> precedence(TaskId first, TaskId to, TaskId root) const override {
    return others_.precedence(first, to, root);
  }
  std::int64_t lateness() const override { return others_.lateness(); }
  PathParts parts(TaskId root, TaskId to) const override { return others_.parts(root, to); }

 private:
  /// Samples for services that stem from one timer.
  struct Stream {
    std::int64_t period, jitter, samples;
  };
  /// Ends of services' jobs after timestamps of roots, each computed once: several paths may lead to a job.
  struct Finishes {
    std::int64_t delay;  ///< From a publication to the decision for the service's job.
    std::map<std::pair<TaskId, TaskId>, std::optional<std::int64_t>> of;  ///< By root and service.
  };

  [[nodiscard]] bool is_service(TaskId id) const { return topology_.set()[id].service; }
  std::int64_t job_work(TaskId id) const { return add(topology_.set()[id].wcet.count(), overheads_.job); }
  /// The time for this much work of one job, which releases interrupt. std::nullopt: no bound.
  std::optional<std::int64_t> with_releases(std::int64_t work) const {
    if (overheads_.release == 0) return work;
    return exact::least_fixed_point(
        work,
        [&](std::int64_t t) {
          std::int64_t sum = work;
          for (const TaskId timer : topology_.timers()) {
            const std::int64_t jobs = add(t, overheads_.lateness) / topology_.set()[timer].period.count() + 1;
            sum = add(sum, multiply(jobs, overheads_.release));
          }
          return sum;
        },
        kLongestDelay);
  }
  /// From a timestamp of `root` until all jobs that it leads to have published for `to`, if services wait for
  /// `known.delay` at most.
  std::optional<std::int64_t> published(TaskId root, TaskId to, Finishes& known) const {
    std::int64_t latest = 0;
    for (const TaskId p : topology_.publishers(to)) {
      if (!topology_.leads_to(root, p)) continue;
      const auto end = finish(root, p, known);
      if (!end) return std::nullopt;
      latest = std::max(latest, *end);
    }
    return latest;
  }
  std::optional<std::int64_t> finish(TaskId root, TaskId id, Finishes& known) const {
    if (!is_service(id)) return others_.until_finish(root, id);
    if (const auto seen = known.of.find({root, id}); seen != known.of.end()) return seen->second;
    auto finish = others_.until_finish(root, id);
    if (const auto request = published(root, id, known)) {
      finish = smaller(finish, sum(add(*request, known.delay), with_releases(job_work(id))));
    }
    known.of[{root, id}] = finish;
    return finish;
  }
  /// By task: the most jobs that one job of `root` leads to.
  std::vector<std::int64_t> jobs_of(TaskId root) const {
    std::vector<std::int64_t> jobs(topology_.size(), 0);
    jobs[root] = 1;
    for (const TaskId id : topology_.order()) {
      for (const TaskId p : topology_.publishers(id)) jobs[id] = add(jobs[id], jobs[p]);
    }
    return jobs;
  }
  /// All samples for services; std::nullopt if some may be published arbitrarily late.
  std::optional<std::vector<Stream>> streams(Finishes& known) const {
    std::vector<Stream> all;
    for (const TaskId root : topology_.timers()) {
      const std::vector<std::int64_t> jobs = jobs_of(root);
      for (TaskId id = 0; id < topology_.size(); ++id) {
        if (!is_service(id)) continue;
        for (const TaskId p : topology_.publishers(id)) {
          if (jobs[p] == 0) continue;
          const auto latest = finish(root, p, known);
          if (!latest) return std::nullopt;
          const std::int64_t earliest =
              add(topology_.least_until_start(root, p), topology_.set()[p].bcet.count());
          all.push_back({topology_.set()[root].period.count(),
                         std::max<std::int64_t>(0, subtract(*latest, earliest)), jobs[p]});
        }
      }
    }
    return all;
  }
  /// The longest delay of a sample in a queue that serves one sample in each step.
  std::optional<std::int64_t> delay_of(const std::vector<Stream>& all) const {
    double utilisation = 0;
    std::int64_t first = 0;
    for (const Stream& s : all) {
      utilisation +=
          static_cast<double>(s.samples) * static_cast<double>(step_) / static_cast<double>(s.period);
      first = add(first, multiply(multiply(s.samples, s.jitter / s.period + 1), step_));
    }
    if (utilisation > kMostUtilisation) return std::nullopt;
    const auto served = exact::least_fixed_point(
        first,
        [&](std::int64_t t) {
          std::int64_t work = 0;
          for (const Stream& s : all) {
            const std::int64_t samples = multiply(s.samples, ceil_div(add(t, s.jitter), s.period));
            work = add(work, multiply(samples, step_));
          }
          return work;
        },
        kLongestDelay);
    if (!served) return std::nullopt;
    // The delay is longest for a sample whose publication is as late as possible after the first one.
    std::vector<std::int64_t> instants = {0};
    for (const Stream& s : all) {
      for (std::int64_t k = ceil_div(s.jitter, s.period); multiply(k, s.period) - s.jitter < *served; ++k) {
        if (instants.size() == kMostInstants) return std::nullopt;
        instants.push_back(multiply(k, s.period) - s.jitter);
      }
    }
    std::int64_t longest = 0;
    for (const std::int64_t t : instants) {
      std::int64_t samples = 0;
      for (const Stream& s : all) {
        samples = add(samples, multiply(s.samples, floor_div(add(t, s.jitter), s.period) + 1));
      }
      longest = std::max(longest, subtract(multiply(samples, step_), t));
    }
    return longest;
  }
  /// Services may call each other: the publications of one are as late as its own delay. Least fixed point.
  std::optional<Finishes> find_finishes() const {
    Finishes known{0, {}};
    for (int round = 0; round < kMostDelays; ++round) {
      const auto all = streams(known);
      const auto next = all ? delay_of(*all) : std::nullopt;
      if (!next || *next > kLongestDelay) return std::nullopt;
      if (*next <= known.delay) return known;
      known = {*next, {}};
    }
    return std::nullopt;
  }

  const GraphTopology& topology_;
  const PathBounds& others_;
  const GraphOverheads overheads_;
  std::int64_t step_ = 0;  ///< Longest time from one service that runs ahead to the next.
  mutable std::optional<Finishes> finishes_;
};

}  // namespace

std::unique_ptr<PathBounds> service_paths(const GraphTopology& topology, const PathBounds& others,
                                          const GraphOverheads& overheads, std::int64_t wait) {
  return std::make_unique<ServicePaths>(topology, others, overheads, wait);
}

}  // namespace hotpath
