// SPDX-License-Identifier: Apache-2.0
// jobs.csv and chains.csv, and the loss equations.
#include "hotpath/core/trace.hpp"

#include <gmock/gmock.h>

#include <sstream>

#include "hotpath/core/accounting.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test::trace_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::string written(const TaskSet& set, const Trace& trace) {
  std::ostringstream out;
  out << kJobsCsvHeader << '\n';
  write_jobs_csv(out, set, trace);
  return out.str();
}

std::vector<Trace> read(const TaskSet& set, const std::string& text) {
  std::istringstream in(text);
  return read_jobs_csv(in, set, "jobs.csv");
}

/// Sequence numbers, and instants in microseconds, are beyond 32 bits.
TEST(JobsCsv, OneRowPerJobAndPerSkippedTimestampRelativeToTheEpoch) {
  TaskSet set;
  const TaskId timer = add_timer(set, 10us, 3ns);
  const TaskId subscription = add_subscription(set, {timer}, 1ns);
  Trace trace;
  trace.executor = "default";
  trace.repetition = 2;
  trace.epoch = at(1000ns);
  const Time timestamp = at(1000ns + 4'294'967'300 * 10us), deadline = timestamp + 10us;
  const JobRecord r{.job = {.task = timer,
                            .sequence = 4'294'967'300,
                            .timestamp = timestamp,
                            .release = timestamp,
                            .deadline = deadline,
                            .skipped = 1},
                    .start = deadline + 2ns,
                    .finish = deadline + 5ns,
                    .worker = 1};
  const Job lost{.task = subscription, .timestamp = r.finish, .parent = r.job.ref()};
  trace.jobs = {r, {.job = lost, .outcome = Outcome::overwritten}};
  const std::string text = kJobsCsvHeader +
                           "\n"
                           "default,2,T0,timer,4294967300,ran,42949673000000,42949673000000,42949673010002,"
                           "42949673010005,,42949673010000,1,,0,,\n"
                           "default,2,T0,timer,4294967301,skipped,42949673010000,,,,,42949673020000,,,0,,\n"
                           "default,2,S1,subscription,0,overwritten,42949673010005,,,,,,,,0,T0,4294967300\n";
  EXPECT_EQ(written(set, trace), text);
  EXPECT_EQ(written(set, read(set, text).at(0)), text);
}

TEST(JobsCsv, RoundTripKeepsEveryRecordOfEveryExecutor) {
  Random random(21);
  for (const ExecutorEntry& executor : executors()) {
    const TaskSet set = random_graph(random, 4, 5, 1.3);
    Trace trace = run(set, std::string(executor.name), 200ms, {}, {.workers = 2});
    trace.repetition = 3;
    const std::vector<Trace> back = read(set, written(set, trace));
    ASSERT_EQ(back.size(), 1U);
    EXPECT_EQ(written(set, back[0]), written(set, trace));
  }
}

TEST(JobsCsv, SeparatesExecutorsAndRepetitions) {
  TaskSet set;
  add_timer(set, 10ms, 1ms);
  Trace a = run(set, "default", 30ms), b = run(set, "rm-ro", 30ms);
  b.repetition = 1;
  std::ostringstream text;
  text << written(set, a);
  write_jobs_csv(text, set, b);
  write_jobs_csv(text, set, a);
  const std::vector<Trace> traces = read(set, text.str());
  ASSERT_EQ(traces.size(), 2U);
  EXPECT_EQ(traces[0].jobs.size(), 6U);
  EXPECT_EQ(traces[1].executor, "rm-ro");
  EXPECT_EQ(traces[1].repetition, 1U);
}

TEST(JobsCsv, AMalformedRowIsRefusedWithFileAndLine) {
  TaskSet set;
  add_timer(set, 10ms, 1ms);
  const std::string good = kJobsCsvHeader + "\nrm-ro,0,T0,timer,0,ran,0,0,0,5,,10,0,,0,,\n";
  ASSERT_EQ(read(set, good).front().jobs.size(), 1U);
  const std::pair<const char*, const char*> rows[] = {
      {"", "1 columns instead of 17"},
      {"rm-ro,0,T9,timer,1,ran,0,0,0,5,,10,0,,0,,", "no task `T9`"},
      {"rm-ro,0,T0,subscription,1,ran,0,0,0,5,,10,0,,0,,", "is a timer"},
      {"rm-ro,0,T0,timer,-1,ran,0,0,0,5,,10,0,,0,,", "column 5"},
      {"rm-ro,0,T0,timer,1,done,0,0,0,5,,10,0,,0,,", "unknown outcome `done`"},
      {"rm-ro,0,T0,timer,1,ran,,0,0,5,,10,0,,0,,", "column 7"},
      {"rm-ro,0,T0,timer,1,ran,0,0,0,5x,,10,0,,0,,", "`5x`"},
      {"rm-ro,0,T0,timer,1,ran,0,0,99999999999999999999,5,,10,0,,0,,", "column 9"},
      {"rm-ro,0,T0,timer,1,ran,0,0,0,,,10,0,,0,,", "a finish_ns"},
      {"rm-ro,0,T0,timer,1,queued,0,0,3,,,10,0,,0,,", "no start_ns"},
      {"rm-ro,0,T0,timer,7,skipped,70,,,,,80,,,0,,", "in sequence"},
      {"rm-ro,0,T0,timer,1,skipped,10000001,,,,,20,,,0,,", "whole number of periods"},
      {"edf-ro,0,T0,timer,1,skipped,10,,,,,20,,,0,,", "must follow"}};
  for (const auto& row : rows) {
    EXPECT_THAT([&] { read(set, good + row.first + "\n"); },
                ThrowsMessage<InputError>(AllOf(HasSubstr("jobs.csv:3: "), HasSubstr(row.second))))
        << row.first;
  }
}

TEST(JobsCsv, AMalformedHeaderIsRefused) {
  for (const char* text : {"", "executor,task\n"}) {
    EXPECT_THAT([&] { read({}, text); },
                ThrowsMessage<InputError>(HasSubstr("jobs.csv:1: the header must be")));
  }
}

std::vector<ChainRow> chains_of(const TaskSet& set, const std::vector<std::string>& chains,
                                std::istream& file) {
  std::vector<ChainRow> rows;
  for_each_chain(file, set, chains, "chains.csv", [&](const ChainRow& row) { rows.push_back(row); });
  return rows;
}

TEST(ChainsCsv, LeavesWhatIsUnknownEmptyAndIsReadBack) {
  Trace trace;
  trace.executor = "rm-ro";
  trace.repetition = 2;
  trace.epoch = Time(100ns);
  trace.chains.push_back({1, 8, 0, 21ns, -1ns, 0, Time(130ns), 0ns});
  trace.chains.push_back({0, 7, 0, 20ns, 31ns, kNoTask});
  TaskSet set;
  set.tasks.emplace_back().name = "sink/topic";
  std::stringstream file;
  file << kChainsCsvHeader << '\n';
  write_chains_csv(file, set, {"hot path", "other"}, trace);
  EXPECT_THAT(file.str(), HasSubstr("\nrm-ro,2,other,8,21,,sink/topic,30,0\nrm-ro,2,hot path,7,20,31,,,\n"));
  const std::vector<ChainRow> rows = chains_of(set, {"hot path", "other"}, file);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].executor, "rm-ro");
  EXPECT_EQ(rows[0].repetition, 2U);
  trace.epoch = Time{};
  trace.chains = {rows[0].record, rows[1].record};
  std::stringstream back;
  back << kChainsCsvHeader << '\n';
  write_chains_csv(back, set, {"hot path", "other"}, trace);
  EXPECT_EQ(back.str(), file.str());
  std::istringstream again(file.str());
  EXPECT_THROW(chains_of(set, {"hot path"}, again), InputError) << "a chain of another run";
}

class Accounting : public testing::Test {
 protected:
  Accounting() {
    timer = add_timer(set, 10ms, 1ms, 5ms);
    subscription = add_subscription(set, {timer}, 1ms);
    trace.epoch = at(100ms);
    trace.end = at(145ms);
  }
  void record(TaskId task, Outcome outcome, std::uint32_t skipped_after = 0) {
    trace.jobs.push_back({.job = {.task = task, .skipped = skipped_after}, .outcome = outcome});
  }
  TaskSet set;
  TaskId timer, subscription;
  Trace trace;
};

TEST_F(Accounting, TimestampsReachedAreRanPlusSkippedPlusQueuedPlusRunning) {
  trace.published = {0, 0};
  record(timer, Outcome::ran, 1);
  record(timer, Outcome::running);
  EXPECT_EQ(account(set, trace)[timer].expected, 4U);  // 105, 115, 125, 135; 145 is the end
  EXPECT_FALSE(account(set, trace)[timer].balanced());
  record(timer, Outcome::queued);
  EXPECT_TRUE(account(set, trace)[timer].balanced());
}

TEST_F(Accounting, SamplesMatchedAreRanPlusOverwrittenPlusUnreadPlusRunning) {
  trace.published = {0, 5};
  for (const Outcome o : {Outcome::ran, Outcome::overwritten, Outcome::queued, Outcome::running}) {
    record(subscription, o);
  }
  record(subscription, Outcome::empty);  // does not count
  EXPECT_EQ(account(set, trace)[subscription].expected, 5U);
  EXPECT_FALSE(account(set, trace)[subscription].balanced());
  record(subscription, Outcome::ran);
  EXPECT_TRUE(account(set, trace)[subscription].balanced());
}

TEST_F(Accounting, TimerThatFirstFallsDueAtTheEndHasNoTimestamp) {
  set.tasks[timer].phase = 45ms;
  EXPECT_EQ(account(set, trace)[timer].expected, 0U);
  set.tasks[timer].phase = 45ms - 1ns;
  EXPECT_EQ(account(set, trace)[timer].expected, 1U);
}

}  // namespace hotpath::test::trace_test
