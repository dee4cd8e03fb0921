// SPDX-License-Identifier: Apache-2.0
// What contracts say of threads: policies, processors, waits, and what they serve.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "watching.hpp"

namespace hotpath::watch {
namespace {

using testing::HasSubstr;

TEST_F(Watching, NamesAWithheldProcessor) {
  system.run(10, 1);
  system.run(22.5, 1);
  until(30);
  check.threads({facts()}, at_ms(1));
  ThreadFacts waited = facts();
  waited.waited = from_ms(0.4);
  waited.stolen = from_ms(0.1);
  check.threads({waited}, at_ms(501));  // 1 ms in a second, within the limit, but as long as the excess
  EXPECT_THAT(incident(),
              HasSubstr("00:00:00.001 main thread spin waited 0.500 ms of 500.000 ms for a processor "
                        "(the hypervisor withheld it 0.100 ms), limit 1.000 ms in a second; "));
  EXPECT_EQ(verdict("main", "wait_ms"), "broken");
}

/// The source exceeds a limit by 1 ms or more; what happened to its thread meanwhile is read later.
class Withheld : public Watching {
 protected:
  Withheld() : Watching(tolerant()) {}
  /// The same contract without bounds of chains; threads may wait 60 ms in a second.
  static std::string tolerant() {
    std::string contract = kContract;
    contract.erase(contract.find("chains:"), contract.find("threads:") - contract.find("chains:"));
    return contract.replace(contract.find("wait_ms: {value: 1,"), 19, "wait_ms: {value: 60,");
  }
  /// A job takes 1 ms too long, as do `further` ones after it.
  void overrun(int further = 0) {
    system.run(10, 1);
    for (int i = 0; i <= further; ++i) system.run(20 + 10 * i, 3);
    system.run(30 + 10 * further, 1);
  }
  /// `ran`: without `further`, jobs last 8 ms.
  std::string cause(Duration waited, Duration withheld = {}, Duration ran = from_ms(7),
                    std::uint32_t thread = 7) {
    until(observed_until);
    ThreadFacts f = facts();
    f.thread = thread;
    check.threads({f}, at_ms(1));
    f.waited = waited;
    f.stolen = withheld;
    f.ran = ran;
    check.threads({f}, at_ms(201));
    return incident();
  }
  double observed_until = 75;
};

TEST_F(Withheld, TimeIsNotBlamedOnTheCallback) {
  overrun();
  EXPECT_THAT(cause(from_ms(1)),
              HasSubstr("00:00:00.001 main thread spin waited 1.000 ms of 200.000 ms for a "
                        "processor, limit 60.000 ms in a second"));
}

TEST_F(Withheld, TimeOfTheHypervisorIsNotBlamedOnTheCallback) {
  overrun();
  EXPECT_THAT(cause({}, from_ms(10)),
              HasSubstr("00:00:00.001 main thread spin waited 10.000 ms of 200.000 ms for a processor (the "
                        "hypervisor withheld it 10.000 ms)"));
}

TEST_F(Withheld, TimeThatIsTooShortExplainsNothing) {
  overrun();
  EXPECT_THAT(cause(from_ms(0.5), from_ms(0.4)), HasSubstr("source (timer) ran 3.000 ms"));
}

TEST_F(Withheld, TimeInWhichTheThreadRanExplainsNothing) {
  overrun();
  EXPECT_THAT(cause({}, from_ms(1000), from_ms(199.5)), HasSubstr("source (timer) ran 3.000 ms"));
}

TEST_F(Withheld, TimeBesideItsJobsExplainsNoOverrun) {
  overrun();
  EXPECT_THAT(cause(from_ms(1), {}, from_ms(8.5)), HasSubstr("source (timer) ran 3.000 ms"));
}

/// Linux does not count at once what a job runs.
TEST_F(Withheld, TimeIsKnownOnceTheThreadIsIdle) {
  overrun();
  until(observed_until);
  ThreadFacts f = facts();
  const auto read = [&](double at, double ran, double waited) {
    f.ran = from_ms(ran);
    f.waited = from_ms(waited);
    check.threads({f}, at_ms(at));
    return incident();
  };
  read(1, 0, 0);
  read(21.5, 2, 0);
  EXPECT_THAT(read(23.5, 4, 1), HasSubstr("source (timer) ran 3.000 ms"));
  EXPECT_THAT(read(24.5, 5, 1), HasSubstr("00:00:00.001 main thread spin waited 1.000 ms of 22.500 ms"));
}

/// A cgroup lets the thread run for a millisecond in between.
TEST_F(Withheld, TimeIsOneCauseWhereItIsCountedInParts) {
  system.run(10, 1);
  system.run(20, 194);
  for (int i = 0; i < 5; ++i) system.run(220 + 10 * i, 1);
  std::size_t next = 0;
  ThreadFacts f = facts();
  for (int ms = 1; ms < 260; ms += 20) {
    for (; next < system.events.size() && system.events[next].at <= at_ms(ms); ++next)
      observer.event(system.events[next]);
    observer.observed_until(at_ms(ms), losses);
    f.waited = from_ms(ms > 213 ? 192.5 : ms > 62 ? 40 : 0);
    f.ran = from_ms(ms > 213 ? 4.5 : ms > 62 ? 3 : ms > 12 ? 2 : 0);
    check.threads({f}, at_ms(ms));
  }
  EXPECT_THAT(incident(), HasSubstr("main thread spin waited 192.500 ms"));
}

TEST_F(Withheld, TimeOfAnotherThreadExplainsNoBudget) {
  overrun();
  system.add(tracing::EventKind::callback_start, 35, {11});
  system.events.back().thread = 8;
  EXPECT_THAT(cause(from_ms(1), {}, {}, 8), HasSubstr("source (timer) ran 3.000 ms"));
}

TEST_F(Withheld, TimeExplainsNoCallbackThatOverrunsAgain) {
  overrun(1);
  EXPECT_THAT(cause(from_ms(1)), HasSubstr("source (timer) ran 3.000 ms"));
}

TEST_F(Withheld, TimeExplainsSilence) {
  system.run(10, 1);
  until(45);
  EXPECT_THAT(incident(), HasSubstr("00:00:00.023 source (timer) got nothing for 35.000 ms"));
  system.run(60, 1);
  until(65);
  EXPECT_THAT(incident(), HasSubstr("00:00:00.023 source (timer) got nothing for 50.000 ms"));
  system.run(70, 1);
  EXPECT_THAT(cause(from_ms(37)), HasSubstr("00:00:00.001 main thread spin waited 37.000 ms of 200.000 ms"));
  EXPECT_EQ(check.incidents().kept().back().breaches(), 2U);
}

TEST_F(Withheld, TimeThatIsShorterThanTheSilenceExplainsNothing) {
  for (const double ms : {10.0, 60.0, 70.0}) system.run(ms, 1);
  EXPECT_THAT(cause(from_ms(36)), HasSubstr("source (timer) got nothing for 50.000 ms"));
}

TEST_F(Withheld, TimeExplainsNoTimerThatStops) {
  system.run(10, 1);
  until(45);
  EXPECT_THAT(cause(from_ms(37)), HasSubstr("source (timer) got nothing for 35.000 ms"));
}

TEST_F(Withheld, TimeExplainsNoOtherPeriod) {
  for (int i = 1; i <= 5; ++i) system.run(15.0 * i, 1);
  EXPECT_THAT(cause(from_ms(2)), HasSubstr("source (timer) got nothing for 15.000 ms"));
}

TEST_F(Watching, TakesNoAlarmFromTheHypervisorsCounterAlone) {
  system.run(10, 1);
  until(20);
  check.threads({facts()}, at_ms(1));
  ThreadFacts later = facts();
  later.stolen = from_ms(1000);
  check.threads({later}, at_ms(1001));
  EXPECT_EQ(verdict("main", "wait_ms"), "held");
}

/// The hypervisor's counter grows after 20 ms; at `late_ms` a job starts 2.5 ms late.
class LateJob : public Watching {
 protected:
  std::string incident_at(int late_ms) {
    ThreadFacts later = facts();
    later.stolen = from_ms(10);
    for (int ms = 10; ms < late_ms; ms += 10) system.run(ms, 1);
    system.run(late_ms + 2.5, 1);
    until(late_ms + 10);
    check.threads({facts()}, at_ms(1));
    check.threads({later}, at_ms(20));
    check.threads({later}, at_ms(late_ms - 10));
    check.threads({later}, at_ms(late_ms + 10));
    return incident();
  }
};

TEST_F(LateJob, IsNoDefectWhereTheHypervisorWithholdsTime) {
  EXPECT_THAT(incident_at(60'000),
              HasSubstr("path took 4.500 ms, bound 4.000 ms (derived), while no assumption "
                        "was seen to be broken; not observable: less than 10 ms that the "
                        "hypervisor withheld"));
}

TEST_F(LateJob, IsADefectWhereTheHypervisorWithheldTimeLongAgo) {
  EXPECT_THAT(incident_at(60'100), HasSubstr("a defect of hotpath"));
}

TEST_F(Watching, AddsTheWaitsOfASecond) {
  system.run(10, 1);
  until(20);
  ThreadFacts f = facts();
  for (int i = 0; i <= 20; ++i) {
    f.waited = from_ms(0.15) * i;
    check.threads({f}, at_ms(1 + 200 * i));
  }
  EXPECT_FALSE(check.broken()) << "0.75 ms in a second: " << incident();
  f.waited += from_ms(0.9);
  check.threads({f}, at_ms(4201));
  EXPECT_THAT(incident(), HasSubstr("00:00:04.001 main thread spin waited 0.900 ms of 200.000 ms"));
}

TEST_F(Watching, ScalesAWaitBetweenReadingsThatAreFarApart) {
  system.run(10, 1);
  until(20);
  ThreadFacts f = facts();
  check.threads({f}, at_ms(1));
  f.waited = from_ms(1.5);
  check.threads({f}, at_ms(2001));
  EXPECT_FALSE(check.broken()) << "0.75 ms in a second: " << incident();
  f.waited += from_ms(3);
  check.threads({f}, at_ms(4001));
  EXPECT_THAT(incident(), HasSubstr("00:00:02.001 main thread spin waited 3.000 ms of 2000.000 ms"));
}

TEST(AThreadThatTheContractLacks, IsNotJudged) {
  std::string text = kContract;
  text.replace(text.find("[source (timer), space.sink/a]"), 30, "[absent (timer)]");
  text.insert(text.find("- node: source"), "- node: absent\n  publishes: []\n");
  ContractCheck check(parse_contract("a contract", text), WallClock(Duration{}));
  Observer observer(&check, nullptr);
  WatchedSystem system;
  system.run(10, 1);
  for (const tracing::Event& event : system.events) observer.event(event);
  ThreadFacts f;
  f.process = f.thread = 7;
  check.threads({f}, at_ms(200));
  check.threads({f}, at_ms(400));
  EXPECT_FALSE(check.broken()) << check.incident({});
}

TEST_F(Watching, NamesChangesOfATimerThread) {
  system.run(10, 1);
  until(20);
  ThreadFacts timers = facts();
  timers.thread = 8;
  timers.timers = true;
  timers.name = "hotpath_timers";
  timers.policy = parse_thread_policy("fifo:81");
  check.threads({facts(), timers}, at_ms(1));
  check.threads({facts(), timers}, at_ms(201));
  EXPECT_FALSE(check.broken()) << incident();
  timers.policy = parse_thread_policy("other");
  check.threads({facts(), timers}, at_ms(401));
  EXPECT_THAT(incident(), HasSubstr("00:00:00.201 main thread hotpath_timers has the policy other instead of "
                                    "fifo:81"));
}

TEST_F(Watching, BlamesNoWaitThatMayBeOlderThanTheThreadsJobs) {
  system.run(10, 1);
  system.run(22.5, 1);
  until(30);
  ThreadFacts waited = facts();
  waited.waited = std::chrono::seconds(60);  // since the thread was created
  check.threads({waited}, at_ms(500));
  check.threads({waited}, at_ms(520));
  EXPECT_THAT(incident(), HasSubstr("00:00:00.024 path took 4.500 ms, bound 4.000 ms (derived)"));
  EXPECT_EQ(verdict("main", "wait_ms"), "held");
}

TEST_F(Watching, NamesChangesOfThreads) {
  system.run(10, 1);
  until(20);
  check.threads({facts()}, at_ms(1));
  ThreadFacts changed = facts();
  changed.policy = parse_thread_policy("other");
  check.threads({changed}, at_ms(1001));
  EXPECT_THAT(incident(), HasSubstr("main thread spin has the policy other instead of fifo:80"));
  EXPECT_EQ(verdict("main", "processors"), "held");
  changed.processors = 2;
  check.threads({changed}, at_ms(2001));
  EXPECT_THAT(check.json({}).dump(), HasSubstr("main thread spin may run on processors 1, contract 1,2"));
}

TEST(ThreadReader, SeesThatThreadsAndProcessesHaveEnded) {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  const auto ended = static_cast<std::uint32_t>(child), own = static_cast<std::uint32_t>(getpid());
  tracing::System system;
  system.processes = {own, ended};  // the thread that created the nodes may run nothing
  system.threads = {{own, own, 0, 0, {}}, {own, ended, 0, 0, {}}};
  ThreadReader reader;
  EXPECT_THAT(reader.read(system, std::chrono::steady_clock::now()).ended,
              testing::UnorderedElementsAre(ThreadKey(own, ended), ThreadKey(ended, 0)));
}

TEST(ThreadFactsOfProc, AreRead) {
  std::string text = "12 (a (b) c) S";
  for (int f = 4; f <= 38; ++f) text += f == 22 ? " 9" : " 0";
  ThreadFacts facts;
  EXPECT_TRUE(parse_stat(text + " 3 0", facts));
  EXPECT_EQ(facts.name, "a (b) c");
  EXPECT_EQ(facts.started, 9U);
  EXPECT_EQ(facts.processor, 3);
  EXPECT_FALSE(parse_stat("12 (a) S 1", facts));
  EXPECT_FALSE(parse_stat("", facts));
  Duration ran{}, waited{};
  EXPECT_TRUE(parse_schedstat("100 7 3\n", ran, waited));
  EXPECT_EQ(ran, Duration(100));
  EXPECT_EQ(waited, Duration(7));
  EXPECT_FALSE(parse_schedstat("100", ran, waited));
}

TEST_F(Watching, LosesNothingOfAProcessThatHasEnded) {
  constexpr std::uint32_t kOther = 8;
  system.run(10, 1);
  const std::size_t first = system.events.size();
  system.add(tracing::EventKind::node_init, 12, {2, 4}, {"sink", "/space"});
  system.add(tracing::EventKind::subscription_init, 12, {20, 2, 23, 2}, {"/a", ""});
  system.run(20, 1);
  system.add(tracing::EventKind::rmw_take, 22, {23, 98, system.stamp, 1});
  for (std::size_t e = first; e < system.events.size(); ++e)
    if (system.events[e].at == at_ms(12) || system.events[e].at == at_ms(22))
      system.events[e].process = kOther;
  observe();
  observer.forget({kOther, 0});
  for (int i = 3; i < 10; ++i) system.run(10 * i, 1);
  until(100);
  EXPECT_EQ(verdict("space.sink/a", "lost"), "held") << incident();
}

}  // namespace
}  // namespace hotpath::watch
