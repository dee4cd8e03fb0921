// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replay.hpp"

#include <algorithm>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/text.hpp"
#include "setup/stored_system.hpp"
#include "telemetry/replayed_trace.hpp"
#include "telemetry/run_info.hpp"
#include "telemetry/run_statistics.hpp"
#include "telemetry/telemetry_writers.hpp"

namespace hotpath::telemetry {

namespace {

constexpr Duration kClockPeriod = std::chrono::milliseconds(10);
constexpr int kTicksPerStatistics = 10;
/// Time to discover readers that are already running.
constexpr Duration kDiscovery = std::chrono::milliseconds(1500);
constexpr Duration kFlush = std::chrono::seconds(1);

class Replay {
 public:
  explicit Replay(const ReplayOptions& options)
      : options_(options),
        run_(options.run, "replay"),
        executor_(options.executor.empty() ? run_.executors().at(0) : options.executor),
        system_(setup::stored_system(run_, options.graph)),
        trace_(load()),
        start_(Time{} + setup::seconds(options.start_s)),
        end_(options.duration_s ? std::min(trace_.end, start_ + setup::seconds(*options.duration_s))
                                : trace_.end) {
    if (start_ >= trace_.end) {
      throw program::UsageError(program::text("--from is after the end of the run, which lasted %.0f s",
                                              to_ms(trace_.end - Time{}) / 1000));
    }
  }

  void run() {
    program::catch_interrupts();
    FastDdsOptions dds;
    dds.domain = options_.domain;
    dds.loopback_only = !options_.all_interfaces;
    Writers writers(dds);
    writers.await_reader(kDiscovery);

    const auto started = now();
    const telemetry::RunInfo info = run_info();
    writers.publish(info);
    RunStatistics statistics(system_.graph, trace_.tasks, info.run_id(), {Time{}, info.epoch_ns()},
                             run_.warm_up());
    advance(start_ - Duration(1), statistics, nullptr);
    statistics.begin_window(start_);
    program::Progress progress(1, real_time(end_));
    progress.begin("replay of " + executor_);
    Time now = start_;
    for (std::int64_t tick = 0; now < end_ && program::interrupted() == 0; ++tick) {
      std::this_thread::sleep_until(started + tick * kClockPeriod);
      const Duration elapsed = hotpath::now() - started;
      now = std::min(start_ + from_ms(to_ms(elapsed) * options_.speed), end_);
      telemetry::Clock clock;
      clock.run_id(info.run_id());
      clock.time_ns(info.epoch_ns() + (now - Time{}).count());
      writers.publish(std::move(clock));
      advance(now, statistics, &writers);
      if (tick % kTicksPerStatistics == kTicksPerStatistics - 1 && now < end_) {
        writers.publish(take(statistics, now));
      }
      progress.update(elapsed, real_time(end_));
    }
    progress.clear();
    if (now == trace_.end) advance(kNever, statistics, &writers);
    telemetry::Statistics last = take(statistics, now);
    last.last(true);
    writers.publish(std::move(last));
    writers.flush(kFlush);
  }

 private:
  ReplayedTrace load() {
    run_.load(system_.tasks.set);
    return replayed_trace(run_, system_.graph, executor_, options_.repetition);
  }

  Duration real_time(Time until) const { return from_ms(to_ms(until - start_) / options_.speed); }

  telemetry::RunInfo run_info() const {
    telemetry::RunInfo info =
        make_run_info(system_.graph, executor_, options_.repetition, unix_ns(Time{} - start_));
    const results::RunRecord& record = run_.record();
    info.transport(record.live ? to_string(record.live->transport) : "simulated");
    info.origin("replay");
    info.speed(options_.speed);
    nlohmann::json facts = record;
    facts.erase("runs");
    info.facts(facts.dump());
    return info;
  }

  /// `writers` is nullptr before the start: jobs count, chains do not.
  void advance(Time now, RunStatistics& statistics, Writers* writers) {
    for (; next_job_ < trace_.jobs.size() && known_at(trace_.jobs[next_job_]) <= now; ++next_job_) {
      statistics.add(trace_.jobs[next_job_]);
    }
    for (; next_chain_ < trace_.chains.size() && trace_.chains[next_chain_].sink_finish <= now;
         ++next_chain_) {
      const ReplayedChain& chain = trace_.chains[next_chain_];
      if (writers != nullptr) writers->publish(statistics.add(chain.record, chain.sink_start));
    }
  }

  telemetry::Statistics take(RunStatistics& statistics, Time now) const {
    // Jobs that were running at the end of the run still published.
    const Time published_by = now == trace_.end ? kNever : now;
    for (TaskId id = 0; id < trace_.published.size(); ++id) {
      const std::vector<Time>& instants = trace_.published[id];
      const auto until = std::upper_bound(instants.begin(), instants.end(), published_by);
      statistics.set_published(id, static_cast<std::uint64_t>(until - instants.begin()));
    }
    return statistics.take(now);
  }

  const ReplayOptions options_;
  results::StoredRun run_;
  const std::string executor_;
  const setup::StoredSystem system_;
  const ReplayedTrace trace_;
  const Time start_, end_;
  std::size_t next_job_ = 0, next_chain_ = 0;
};

}  // namespace

void replay_run(const ReplayOptions& options) { Replay(options).run(); }

}  // namespace hotpath::telemetry
