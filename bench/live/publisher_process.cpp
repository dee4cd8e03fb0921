// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>
#include <sys/resource.h>

#include <csignal>
#include <exception>

#include "hotpath/live/clock.hpp"
#include "live/publisher.hpp"
#include "setup/run_setup.hpp"
#include "telemetry/run_statistics.hpp"
#include "telemetry/telemetry_writers.hpp"
#include "telemetry/trace_tail.hpp"

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
      : plan_(plan),
        memories_(memories),
        writers_(writers),
        tail_(memories),
        join_(index_chains(*plan.graph, plan.tasks), plan.tasks.set.size()),
        info_(telemetry::make_run_info(*plan.graph, *plan.published, plan.executor.label, plan.repetition,
                                       telemetry::unix_ns(epoch - now()))),
        counted_from_(epoch + setup::seconds(plan.published->warm_up_s)),
        statistics_(*plan.graph, plan.tasks, info_, epoch, counted_from_ - epoch),
        end_(end) {
    if (is_dds(plan.transport)) info_.topic_prefix(plan.fastdds.topic_prefix);
    writers_.publish(info_);
  }

  void send_samples() {
    telemetry::TraceTail::News news = tail_.read();
    for (JobRecord& record : news.jobs) {
      if (record.outcome == Outcome::ran && record.finish > end_) record.outcome = Outcome::running;
      statistics_.add(record);
      join_.add(record);
    }
    pending_.insert(pending_.end(), news.observations.begin(), news.observations.end());
    // The records of a chain's jobs may arrive shortly after the sink's observation.
    std::erase_if(pending_, [this](const ChainObservation& o) { return send(o, false); });
  }

  void send_statistics(Time now) { writers_.publish(take_statistics(now)); }

  /// All records are complete, and no job started at or after `end`.
  void finish(Time end) {
    end_ = std::min(end_, end);
    send_samples();
    for (const ChainObservation& o : pending_) send(o, true);
    telemetry::Statistics statistics = take_statistics(end_);
    statistics.last(true);
    writers_.publish(std::move(statistics));
  }

 private:
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

  telemetry::Statistics take_statistics(Time now) {
    for (TaskId fed = 0; fed < plan_.tasks.set.size(); ++fed) {
      if (plan_.tasks.set[fed].kind == TaskKind::subscription) {
        statistics_.set_published(fed, published_for(memories_, fed));
      }
    }
    return statistics_.take(now);
  }

  const Plan& plan_;
  const std::deque<RunMemory>& memories_;
  telemetry::Writers& writers_;
  telemetry::TraceTail tail_;
  ChainJoin join_;
  telemetry::RunInfo info_;
  const Time counted_from_;
  telemetry::RunStatistics statistics_;
  Time end_;
  std::vector<ChainObservation> pending_;
};

/// Sends until the coordinator stops the run or is gone.
void send_until_stop(Sender& sender, const Channel& coordinator, Time epoch, Time end) {
  Time next_statistics = epoch + kStatisticsPeriod;
  for (;;) {
    const auto message = coordinator.receive(now() + kPoll);
    if (message && message->kind == Kind::closed) return sender.finish(now());
    if (message && message->kind == Kind::stop) return sender.finish(from_ns(message->number[0]));
    sender.send_samples();
    const Time now = hotpath::now();
    if (now < next_statistics || now >= end) continue;
    sender.send_statistics(now);
    while (next_statistics <= now) next_statistics += kStatisticsPeriod;
  }
}

void send_run(const Plan& plan, const std::deque<RunMemory>& memories, const Channel& coordinator) {
  FastDdsOptions options = plan.fastdds;
  options.network = FastDdsOptions::Network::udp;  // leaves no file behind, however this process ends
  telemetry::Writers writers(options);
  coordinator.send(Kind::matched);

  for (;;) {
    const auto begin = coordinator.receive(now() + std::chrono::hours(1));
    if (begin && (begin->kind == Kind::closed || begin->kind == Kind::stop)) return;
    if (!begin || begin->kind != Kind::begin) continue;
    const Time epoch = from_ns(begin->number[0]), end = from_ns(begin->number[1]);
    Sender sender(plan, memories, writers, epoch, end);
    send_until_stop(sender, coordinator, epoch, end);
    break;
  }
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
