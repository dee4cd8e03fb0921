// SPDX-License-Identifier: Apache-2.0
#include "explain/explainer.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace hotpath::explain {

Explainer::Explainer(const System& system, Target target, std::vector<Output> outputs, std::string run,
                     Use use)
    : system_(system),
      target_(target),
      outputs_(std::move(outputs)),
      use_(std::move(use)),
      window_(system.tasks().set.size(), std::move(run)),
      paths_(system, window_) {
  for (const Output& output : outputs_) longest_ = std::max(longest_, output.latency);
}

void Explainer::begin(std::uint32_t repetition, RepetitionFacts facts) {
  repetition_ = repetition;
  facts_ = std::move(facts);
  window_.clear();
  now_ = Time::min();
}

void Explainer::add(const JobRecord& record) {
  if (!started(record)) return;
  now_ = record.start;
  explain_finished();
  constexpr std::size_t kBetween = 1024;  // jobs between two clean-ups
  if (++added_ % kBetween == 0) window_.forget_before(now_ - longest_);
  const Seen& seen = window_.add(record);
  if (record.outcome == Outcome::ran) add_sink(seen);
}

void Explainer::end() {
  now_ = kNever;
  explain_finished();
}

void Explainer::add_sink(const Seen& sink) {
  const JobRecord& r = sink.record;
  const bool ends =
      target_.chain ? system_.chains()[*target_.chain].ends_in(r.job.task) : r.job.task == target_.task;
  if (!ends) return;
  const Output first{repetition_, r.job.sequence, Duration{}};
  auto output = std::ranges::lower_bound(outputs_, first);
  for (; output != outputs_.end() && output->repetition == repetition_ && output->sequence == r.job.sequence;
       ++output) {
    if (!target_.chain) {
      unfinished_.push_back(sink);
      continue;
    }
    const ChainIndex& chain = system_.chains()[*target_.chain];
    const Time source_start = r.start - output->latency;
    std::vector<const Seen*> path = paths_.from_source(sink, chain, source_start);
    const bool complete = !path.empty();
    // Another task of the sink's node may have a job of this sequence.
    if (!complete && chain.sink_tasks.size() > 1) continue;
    if (!complete) path = paths_.of_triggers(sink, source_start);
    explain_output(sink, path, output->latency, complete);
  }
}

void Explainer::explain_output(const Seen& sink, const std::vector<const Seen*>& path, Duration latency,
                               bool complete) {
  Account account(system_, window_, facts_);
  Explanation explanation{repetition_, latency, {}, complete, {}};
  for (const Seen* job : path) explanation.path.push_back(job->record);
  const Time end = sink.record.start;
  Time done = end - latency;
  if (path.front()->record.start > done) {
    account.add(Cause::unexplained, 0, path.front()->record.start - done);
    done = path.front()->record.start;
  }
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const JobRecord &job = path[i]->record, &next = path[i + 1]->record;
    const bool direct = next.job.parent == job.job.ref();
    // The rest of the job, after the publication, counts as running while the next job waits for it.
    const Time handed_over = direct && job.worker != next.worker ? next.job.timestamp : job.finish;
    const Time ran = std::clamp(handed_over, done, std::max(done, next.start));
    account.run(job, i, done, ran);
    done = ran;
    if (!direct) {
      const Time ready = std::clamp(next.job.timestamp, done, std::max(done, next.start));
      account.add(Cause::join, i + 1, ready - done);
      done = ready;
    }
    if (next.start <= done) continue;
    account.wait(*path[i + 1], i + 1, done, &job);
    done = next.start;
  }
  use(account, std::move(explanation));
}

void Explainer::explain_finished() {
  const auto explain = [&](const Seen& job) {
    const JobRecord& r = job.record;
    if (r.finish > now_) return false;
    Account account(system_, window_, facts_);
    account.wait(job, 0, r.job.timestamp, nullptr);
    account.run(r, 0, std::max(r.start, r.job.timestamp), r.finish);
    use(account, {repetition_, r.finish - r.job.timestamp, {r}, true, {}});
    return true;
  };
  std::erase_if(unfinished_, explain);
}

void Explainer::use(Account& account, Explanation explanation) {
  explanation.parts = account.take();
  ++explained_;
  use_(explanation);
}

}  // namespace hotpath::explain
