// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "import/hypothesis.hpp"

namespace hotpath::imports {

namespace {

class Steps {
 public:
  Steps(const RecordedGraph& graph, const RecordedWindow& window, const RecordedExecutor& executor)
      : graph_(graph), set_(graph.tasks.set), window_(window), executor_(executor) {
    result_.epoch = graph.epoch;
    result_.ready.resize(set_.size());
    result_.decided.resize(set_.size());
    result_.ready_on.resize(executor.threads.size());
    result_.own.resize(set_.size(), false);
    result_.has_timers.resize(executor.threads.size(), false);
    result_.has_others.resize(executor.threads.size(), false);
    result_.deadline.resize(window.jobs.size(), kNever);
  }

  RecordedSteps make(std::span<const tracing::LostSample> lost, std::size_t most) {
    for (std::uint32_t j = 0; j < window_.jobs.size() && result_.starts < most; ++j) add_job(j);
    for (const tracing::LostSample& sample : lost) {
      const TaskId task = graph_.task({sample.subscription, 0});
      if (task != kNoTask && result_.own[task] && sample.sample.published < last_)
        add_arrival(task, sample.sample);
    }
    std::ranges::sort(all_, {}, [](const Placed& p) { return std::tuple(p.step.at, p.event, p.step.task); });
    for (Placed& p : all_) result_.steps.push_back(p.step);
    find_contests();
    return std::move(result_);
  }

 private:
  struct Placed {
    RecordedStep step;
    std::uint64_t event;
  };

  void add_job(std::uint32_t j) {
    const tracing::Job& job = window_.jobs[j];
    const TaskId task = graph_.task(job.ref);
    if (task == kNoTask) return;
    const Time ready = window_.records[j].job.timestamp;
    job_at_[{task, job.ref.number}] = j;
    const bool timer = set_[task].kind == TaskKind::timer;
    const std::uint32_t parent = recorded_job(job.sample.parent);
    if (timer) result_.deadline[j] = ready + set_[task].period;
    if (!timer && parent != kNone) result_.deadline[j] = result_.deadline[parent];
    const auto thread = std::ranges::find(executor_.threads, job.thread);
    if (thread == executor_.threads.end()) return;
    const auto t = static_cast<std::uint32_t>(thread - executor_.threads.begin());
    result_.own[task] = true;
    (timer ? result_.has_timers : result_.has_others)[t] = true;
    ++result_.starts;
    last_ = job.start;
    if (!timer) add_arrival(task, job.sample);
    result_.ready[task].push_back(ready);
    result_.ready_on[t].push_back(ready);
    const bool shows_decision = job.decided > Time{} && job.decided >= ready;
    RecordedStep step{.shows_decision = shows_decision,
                      .at = shows_decision ? job.decided : job.start,
                      .task = task,
                      .thread = t,
                      .job = j,
                      .ready = ready};
    result_.decided[task].emplace_back(step.at, t);
    all_.push_back({step, shows_decision ? job.question : job.started});
    step.kind = RecordedStep::Kind::finish;
    step.at = job.finish;
    if (job.ended) all_.push_back({step, job.finished});
  }

  void add_arrival(TaskId task, const tracing::Sample& sample) {
    const std::uint32_t parent = recorded_job(sample.parent);
    std::uint64_t event = 0;
    if (parent != kNone)
      for (const tracing::Publication& p : window_.jobs[parent].published)
        if (p.at == sample.published) event = p.event;
    all_.push_back(
        {{.kind = RecordedStep::Kind::arrival, .at = sample.published, .task = task, .job = parent}, event});
  }

  std::uint32_t recorded_job(const tracing::JobRef& ref) const {
    const auto job = job_at_.find({graph_.task(ref), ref.number});
    return job == job_at_.end() ? kNone : job->second;
  }

  /// Marks the decisions at which a task was ready that ran later.
  void find_contests() {
    std::vector<std::size_t> started(set_.size(), 0);
    std::vector<int> running(set_.groups.size(), 0);
    std::vector<Time> free(executor_.threads.size(), Time::min());
    std::vector<TaskId> own;
    for (TaskId id = 0; id < set_.size(); ++id)
      if (result_.own[id]) own.push_back(id);
    for (RecordedStep& step : result_.steps) {
      if (step.kind == RecordedStep::Kind::arrival) continue;
      const bool exclusive = set_.groups[set_[step.task].group] == CallbackGroup::mutually_exclusive;
      if (step.kind == RecordedStep::Kind::finish) {
        free[step.thread] = step.at;
        if (exclusive) --running[set_[step.task].group];
        continue;
      }
      step.free = free[step.thread];
      step.contested = std::ranges::any_of(own, [&](TaskId id) {
        const std::vector<Time>& ready = result_.ready[id];
        return id != step.task && running[set_[id].group] == 0 && started[id] < ready.size() &&
               ready[started[id]] <= step.at;
      });
      ++started[step.task];
      if (exclusive) ++running[set_[step.task].group];
    }
  }

  const RecordedGraph& graph_;
  const TaskSet& set_;
  const RecordedWindow& window_;
  const RecordedExecutor& executor_;
  std::map<std::pair<TaskId, std::uint64_t>, std::uint32_t> job_at_;  // by task and number
  std::vector<Placed> all_;
  Time last_{};
  RecordedSteps result_;
};

}  // namespace

RecordedSteps recorded_steps(const RecordedGraph& graph, const RecordedWindow& window,
                             std::span<const tracing::LostSample> lost, const RecordedExecutor& executor,
                             std::size_t most) {
  return Steps(graph, window, executor).make(lost, most);
}

}  // namespace hotpath::imports
