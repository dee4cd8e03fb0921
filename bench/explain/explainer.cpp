// SPDX-License-Identifier: Apache-2.0
#include "explain/explainer.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace hotpath::explain {

namespace {

auto key_of(const Output& output) { return std::pair(output.repetition, output.sequence); }

}  // namespace

Explainer::Explainer(const System& system, Target target, std::vector<Output> outputs, std::string run,
                     Use use)
    : system_(system),
      target_(target),
      outputs_(std::move(outputs)),
      use_(std::move(use)),
      done_(outputs_.size(), false),
      window_(system.tasks().set.size(), std::move(run)),
      paths_(system, window_, target.chain) {
  std::ranges::stable_sort(outputs_, {}, key_of);
  for (const Output& output : outputs_) longest_ = std::max(longest_, output.latency);
}

void Explainer::begin(std::uint32_t repetition, const ExecutionTimes* times) {
  repetition_ = repetition;
  times_ = times;
  window_.clear();
  paths_.clear();
  now_ = Time::min();
}

void Explainer::add(const JobRecord& record) {
  if (!started(record)) return;
  now_ = record.start;
  explain_finished();
  constexpr std::size_t kBetween = 1024;  // jobs between two clean-ups
  if (++added_ % kBetween == 0) {
    Time first = now_;
    for (const Seen& job : unfinished_) first = std::min(first, job.record.start);
    window_.forget_before(first - longest_);
  }
  const Seen& seen = window_.add(record);
  paths_.add(seen);
  if (!outputs_of(record.job).empty()) unfinished_.push_back(seen);
}

void Explainer::end() {
  now_ = kNever;
  explain_finished();
}

/// The outputs that may be those of a job.
std::span<const Output> Explainer::outputs_of(const Job& job) const {
  const bool ends =
      target_.chain ? system_.chains()[*target_.chain].ends_in(job.task) : job.task == target_.task;
  if (!ends) return {};
  return std::ranges::equal_range(outputs_, std::pair(repetition_, job.sequence), {}, key_of);
}

void Explainer::explain_finished() {
  const auto finish = [](const Seen& job) { return job.record.finish; };
  if (unfinished_.size() > 1) std::ranges::stable_sort(unfinished_, {}, finish);
  std::erase_if(unfinished_, [this](const Seen& job) {
    if (job.record.finish > now_) return false;
    for (const Output& output : outputs_of(job.record.job)) {
      const auto place = static_cast<std::size_t>(&output - outputs_.data());
      if (done_[place] || (output.sink != kNoTask && output.sink != job.record.job.task)) continue;
      done_[place] = target_.chain ? explain_output(job, output) : explain_response(job);
      if (done_[place]) break;
    }
    return true;
  });
}

bool Explainer::explain_response(const Seen& job) {
  const JobRecord& r = job.record;
  Account account(system_, window_, times_);
  account.wait(job, 0, r.job.timestamp, r.start, nullptr);
  account.run(r, 0, std::max(r.start, r.job.timestamp), r.finish);
  use(account, {repetition_, r.finish - r.job.timestamp, {r}, true, {}});
  return true;
}

/// False if it is the output of another task of the sink's node, with a job of the same sequence.
bool Explainer::explain_output(const Seen& sink, const Output& output) {
  const ChainIndex& chain = system_.chains()[*target_.chain];
  const Duration latency = output.latency;
  const Time begin = sink.record.start - latency;
  const std::vector<const Seen*> path = paths_.from_source(sink, begin);
  if (path.empty() && output.sink == kNoTask && chain.sink_tasks.size() > 1) return false;
  path.empty() ? explain_path(paths_.of_triggers(sink, begin), latency, false)
               : explain_path(path, latency, true);
  return true;
}

/// A cyclic node may read data that arrived after its job's start, where the latency ends.
void Explainer::explain_path(const std::vector<const Seen*>& path, Duration latency, bool complete) {
  Account account(system_, window_, times_);
  Explanation explanation{repetition_, latency, {}, complete, {}};
  for (const Seen* job : path) explanation.path.push_back(job->record);
  const Time end = path.back()->record.start;
  Time done = end - latency;
  const Time begin = std::clamp(path.front()->record.start, done, end);
  account.add(Cause::unexplained, 0, begin - done);
  done = begin;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const JobRecord &job = path[i]->record, &next = path[i + 1]->record;
    const Time until = std::clamp(next.start, done, end);
    const bool direct = next.job.parent == job.job.ref();
    // The rest of the job, after the publication, counts as running while the next job waits for it.
    const Time handed_over = direct && job.worker != next.worker ? next.job.timestamp : job.finish;
    const Time ran = std::clamp(handed_over, done, until);
    account.run(job, i, done, ran);
    const Time ready = direct ? ran : std::clamp(next.job.timestamp, ran, until);
    account.add(Cause::join, i + 1, ready - ran);
    account.wait(*path[i + 1], i + 1, ready, until, &job);
    done = until;
  }
  use(account, std::move(explanation));
}

void Explainer::use(Account& account, Explanation explanation) {
  explanation.parts = account.take();
  ++explained_;
  use_(explanation);
}

}  // namespace hotpath::explain
