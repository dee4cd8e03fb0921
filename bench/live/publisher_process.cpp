// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <span>

#include "hotpath/live/clock.hpp"
#include "live/repetition_runner.hpp"
#include "setup/run_setup.hpp"
#include "telemetry/run_statistics.hpp"
#include "telemetry/telemetry_writers.hpp"

namespace hotpath::live {

namespace {

using Kind = ChannelMessage::Kind;

constexpr Duration kPoll = std::chrono::milliseconds(10);
constexpr Duration kStatisticsPeriod = std::chrono::milliseconds(100);
/// SCHED_IDLE would disturb less, but it starves on a busy machine.
constexpr int kNice = 19;
/// Time for the last samples to reach their readers.
constexpr Duration kFlush = std::chrono::seconds(1);

/// Sends the records of one repetition to the writers.
class Sender {
 public:
  Sender(const Plan& plan, const std::deque<RunMemory>& memories, telemetry::Writers& writers, Time epoch,
         Time end)
      : memories_(memories),
        writers_(writers),
        epoch_(epoch),
        end_(end),
        info_(telemetry::make_run_info(*plan.graph, *plan.published, plan.executor.label, plan.repetition,
                                       telemetry::unix_ns(epoch - now()))),
        counted_from_(epoch + from_s(plan.published->warm_up_s)),
        statistics_(*plan.graph, plan.tasks, info_, epoch, counted_from_ - epoch),
        join_(index_chains(*plan.graph, plan.tasks), plan.tasks.set.size()),
        seen_(counts().size(), 0) {
    if (is_dds(plan.transport)) info_.topic_prefix(plan.fastdds.topic_prefix);
    writers_.publish(info_);
  }

  /// Sends until the coordinator stops the run or is gone.
  void send_until_stop(const Channel& coordinator) {
    Time next_statistics = epoch_ + kStatisticsPeriod;
    for (;;) {
      const auto message = coordinator.receive(now() + kPoll);
      if (message && message->kind == Kind::closed) return finish(now());
      if (message && message->kind == Kind::stop) return finish(from_ns(message->number[0]));
      send_samples();
      const Time now = hotpath::now();
      if (now < next_statistics || now >= end_) continue;
      writers_.publish(statistics(now));
      while (next_statistics <= now) next_statistics += kStatisticsPeriod;
    }
  }

 private:
  /// The records of each log of jobs and of observations.
  std::vector<std::size_t> counts() const {
    std::vector<std::size_t> counts;
    for (const RunMemory& memory : memories_) {
      for (const auto& log : memory.jobs()) counts.push_back(log.contents().size());
      for (const auto& log : memory.chains()) counts.push_back(log.contents().size());
    }
    return counts;
  }

  /// Reads the new records without disturbing the processes that write them.
  void send_samples() {
    // Logs only grow: if two passes have equal counts, these are a snapshot of a time between them, in which
    // no job precedes a job that it waited for.
    std::vector<std::size_t> snapshot = counts();
    for (auto again = counts(); again != snapshot; again = counts()) snapshot = std::move(again);
    std::vector<JobRecord> jobs;
    const std::size_t waiting = pending_.size();
    std::size_t number = 0;
    const auto append_new = [&](const auto& log, auto& to) {
      const auto added = log.contents().first(snapshot[number]).subspan(seen_[number]);
      to.insert(to.end(), added.begin(), added.end());
      ++number;
    };
    for (const RunMemory& memory : memories_) {
      for (const auto& log : memory.jobs()) append_new(log, jobs);
      for (const auto& log : memory.chains()) append_new(log, pending_);
    }
    seen_ = std::move(snapshot);
    std::ranges::stable_sort(jobs, {}, &JobRecord::finish);
    std::ranges::stable_sort(std::span(pending_).subspan(waiting), {}, &ChainObservation::sink_start);
    for (JobRecord& record : jobs) {
      if (record.outcome == Outcome::ran && record.finish > end_) record.outcome = Outcome::running;
      statistics_.add(record);
      join_.add(record);
    }
    // The records of a chain's jobs may arrive shortly after the sink's observation.
    std::erase_if(pending_, [this](const ChainObservation& o) { return send(o, false); });
  }

  telemetry::Statistics statistics(Time now) {
    return statistics_.take(now, [&](TaskId id) { return published_for(memories_, id); });
  }

  /// All records are complete, and no job started at or after `end`.
  void finish(Time end) {
    end_ = std::min(end_, end);
    send_samples();
    for (const ChainObservation& o : pending_) send(o, true);
    telemetry::Statistics last = statistics(end_);
    last.last(true);
    writers_.publish(std::move(last));
  }

  /// False if the record of a job of the chain is still missing. `all`: no more records will come.
  bool send(const ChainObservation& observation, bool all) {
    const ChainRecord record = join_.join(observation);
    if (record.end_to_end_latency.count() < 0 && !all) return false;
    const std::optional<Time> timestamp = join_.sink_timestamp(observation.sink);
    if (!timestamp || *timestamp >= counted_from_) {
      writers_.publish(statistics_.add(record, observation.sink_start));
    }
    return true;
  }

  const std::deque<RunMemory>& memories_;
  telemetry::Writers& writers_;
  const Time epoch_;
  Time end_;
  telemetry::RunInfo info_;
  const Time counted_from_;
  telemetry::RunStatistics statistics_;
  ChainJoin join_;
  std::vector<std::size_t> seen_;  ///< The number of records of each log that were sent.
  std::vector<ChainObservation> pending_;
};

void send_run(const Plan& plan, const std::deque<RunMemory>& memories, const Channel& coordinator) {
  FastDdsOptions options = plan.fastdds;
  options.network = FastDdsOptions::Network::udp;  // leaves no file behind, however this process ends
  telemetry::Writers writers(options);
  coordinator.send(Kind::matched);
  std::optional<ChannelMessage> begin;
  while (!begin) begin = coordinator.receive(now() + std::chrono::hours(1));
  if (begin->kind != Kind::begin) return;  // the run has ended
  Sender(plan, memories, writers, from_ns(begin->number[0]), from_ns(begin->number[1]))
      .send_until_stop(coordinator);
  writers.flush(kFlush);
  coordinator.send({Kind::done, {static_cast<std::int64_t>(writers.samples_lost())}});
}

}  // namespace

int run_publisher_process(const Plan& plan, const std::deque<RunMemory>& memories,
                          const Channel& coordinator) {
  // As in the measured processes, the coordinator handles the terminal's signals.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  pthread_setname_np(pthread_self(), "live_sender");
  setpriority(PRIO_PROCESS, 0, kNice);
  try {
    if (!plan.live_cpus.empty()) pin_to_cpus(plan.live_cpus);
    send_run(plan, memories, coordinator);
    return 0;
  } catch (const std::exception& error) {
    coordinator.send({Kind::failed, {}, error.what()});
    return 1;
  }
}

}  // namespace hotpath::live
