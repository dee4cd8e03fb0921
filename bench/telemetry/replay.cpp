// SPDX-License-Identifier: Apache-2.0
#include "telemetry/replay.hpp"

#include <algorithm>
#include <map>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/text.hpp"
#include "setup/stored_system.hpp"
#include "telemetry/run_statistics.hpp"
#include "telemetry/telemetry_writers.hpp"

namespace hotpath::telemetry {

namespace {

constexpr Duration kClockPeriod = std::chrono::milliseconds(10);
constexpr int kTicksPerStatistics = 10;
/// Time to discover readers that are already running.
constexpr Duration kDiscovery = std::chrono::milliseconds(1500);
constexpr Duration kFlush = std::chrono::seconds(1);

/// An output of a chain, with the start and finish of its sink's job.
struct Output {
  ChainRecord record;
  Time sink_start{}, sink_finish{};  ///< Finish: kNever if the run ended first.
};

/// When a record became known.
Time known_at(const JobRecord& r) { return r.outcome == Outcome::ran ? r.finish : r.job.timestamp; }

/// A complete repetition ends as planned, an interrupted repetition with its last record.
Time end_of(const results::StoredRun& run, const Trace& trace) {
  const Time planned = Time{} + run.length();
  const results::RepetitionRecord& last = run.record().runs.back();
  const bool interrupted =
      run.record().partial && last.executor == trace.executor && last.repetition == trace.repetition;
  if (!interrupted) return planned;
  Time end{};
  for (const JobRecord& r : trace.jobs) end = std::max({end, r.start, r.finish, r.job.timestamp});
  return std::min(end + Duration(1), planned);
}

/// By finish of the sink's job.
std::vector<Output> outputs_of(const results::StoredRun& run, const Trace& trace, const Graph& graph) {
  std::map<std::pair<TaskId, std::uint64_t>, const JobRecord*> sinks;  // started jobs, by task and sequence
  for (const ChainRecord& r : trace.chains) sinks[{r.sink, r.sequence}] = nullptr;
  for (const JobRecord& r : trace.jobs) {
    const auto sink = sinks.find({r.job.task, r.job.sequence});
    if (sink != sinks.end() && r.started()) sink->second = &r;
  }
  std::vector<Output> outputs;
  for (const ChainRecord& record : trace.chains) {
    const std::string& name = run.chains()[record.chain];
    const auto chain = std::ranges::find(graph.chains, name, &Chain::name);
    if (chain == graph.chains.end())
      run.fail("the graph has no chain `" + name + "`; give the run's own graph with --graph");
    const JobRecord* const sink = sinks.at({record.sink, record.sequence});
    if (sink == nullptr) {
      run.fail("jobs.csv has no job " + std::to_string(record.sequence) + " of the sink of chain `" + name +
               "`; the files do not belong to one run");
    }
    outputs.push_back({record, sink->start, sink->outcome == Outcome::ran ? sink->finish : kNever});
    outputs.back().record.chain = static_cast<std::uint32_t>(chain - graph.chains.begin());
  }
  std::ranges::stable_sort(outputs, {}, &Output::sink_finish);
  return outputs;
}

/// A repetition of a stored run, whose epoch is time 0.
class Replay {
 public:
  explicit Replay(const ReplayOptions& options)
      : options_(options),
        run_(options.run, "replay"),
        executor_(options.executor.empty() ? run_.executors().at(0) : options.executor),
        system_(setup::stored_system(run_, options.graph)),
        start_(Time{} + from_s(options.start_s)) {
    run_.load(system_.tasks.set);
    tasks_ = system_.tasks_of(run_, executor_, options.repetition);
    const Trace& trace = run_.trace(executor_, options.repetition);
    published_.resize(tasks_.set.size());
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome == Outcome::ran || r.outcome == Outcome::overwritten) jobs_.push_back(r);
      if (tasks_.set[r.job.task].kind == TaskKind::subscription && r.outcome != Outcome::empty)
        published_[r.job.task].push_back(r.job.timestamp);
    }
    std::ranges::stable_sort(jobs_, {}, known_at);
    for (std::vector<Time>& instants : published_) std::ranges::sort(instants);
    outputs_ = outputs_of(run_, trace, system_.graph);
    run_end_ = end_of(run_, trace);
    if (start_ >= run_end_) {
      throw program::UsageError(
          program::text("--from is after the end of the run, which lasted %.0f s", to_s(run_end_ - Time{})));
    }
    end_ = options.duration_s ? std::min(run_end_, start_ + from_s(*options.duration_s)) : run_end_;
  }

  void run() {
    program::catch_interrupts();
    FastDdsOptions dds;
    dds.domain = options_.domain;
    dds.loopback_only = !options_.all_interfaces;
    Writers writers(dds);
    writers.await_reader(kDiscovery);

    const auto started = now();
    telemetry::RunInfo info =
        make_run_info(system_.graph, run_.record(), executor_, options_.repetition, unix_ns(Time{} - start_));
    info.origin("replay");
    info.speed(speed_);
    writers.publish(info);
    RunStatistics statistics(system_.graph, tasks_, info, Time{}, run_.warm_up());
    advance(start_ - Duration(1), statistics, nullptr);
    statistics.begin_window(start_);
    program::Progress progress(1, real_time(end_));
    progress.begin("replay of " + executor_);
    Time now = start_;
    for (std::int64_t tick = 0; now < end_ && program::interrupted() == 0; ++tick) {
      std::this_thread::sleep_until(started + tick * kClockPeriod);
      const Duration elapsed = hotpath::now() - started;
      now = std::min(start_ + from_ms(to_ms(elapsed) * speed_), end_);
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
    if (now == run_end_) advance(kNever, statistics, &writers);
    telemetry::Statistics last = take(statistics, now);
    last.last(true);
    writers.publish(std::move(last));
    writers.flush(kFlush);
  }

 private:
  Duration real_time(Time until) const { return from_ms(to_ms(until - start_) / speed_); }

  /// `writers` is nullptr before the start: jobs count, chains do not.
  void advance(Time now, RunStatistics& statistics, Writers* writers) {
    for (; next_job_ < jobs_.size() && known_at(jobs_[next_job_]) <= now; ++next_job_)
      statistics.add(jobs_[next_job_]);
    for (; next_output_ < outputs_.size() && outputs_[next_output_].sink_finish <= now; ++next_output_) {
      const Output& output = outputs_[next_output_];
      if (writers != nullptr) writers->publish(statistics.add(output.record, output.sink_start));
    }
  }

  telemetry::Statistics take(RunStatistics& statistics, Time now) const {
    return statistics.take(now, [&](TaskId id) {
      // Jobs that were running at the end of the run still published.
      const auto until = std::ranges::upper_bound(published_[id], now == run_end_ ? kNever : now);
      return static_cast<std::uint64_t>(until - published_[id].begin());
    });
  }

  const ReplayOptions options_;
  const double speed_ = options_.rate_percent / 100;
  results::StoredRun run_;
  const std::string executor_;
  const setup::StoredSystem system_;
  const Time start_;
  Time run_end_{}, end_{};                    // of the run, and of what is replayed
  GraphTasks tasks_;                          // with the phases of the repetition
  std::vector<JobRecord> jobs_;               // that ran, and overwritten samples, as they became known
  std::vector<Output> outputs_;               // in the order in which they became known
  std::vector<std::vector<Time>> published_;  // by task: publications of its samples, in order
  std::size_t next_job_ = 0, next_output_ = 0;
};

}  // namespace

void replay_run(const ReplayOptions& options) { Replay(options).run(); }

}  // namespace hotpath::telemetry
