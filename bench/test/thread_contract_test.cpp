// SPDX-License-Identifier: Apache-2.0
// What contracts say of threads: policies, processors, waits, and what they serve.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "watching.hpp"

namespace hotpath::watch::thread_contract_test {

using testing::HasSubstr;

TEST_F(Watching, ListsAWaitThatBreaksNoTerm) {
  system.run(10, 1);
  system.run(22.5, 1);
  until(30);
  observer.threads({facts()}, at_ms(1));
  ThreadFacts waited = facts();
  waited.waited = from_ms(0.4);
  waited.stolen = from_ms(0.1);
  observer.threads({waited}, at_ms(501));
  EXPECT_EQ(incident(), "00:00:00.024 path took 4.500 ms, bound 4.000 ms (derived)");
  EXPECT_THAT(others(), testing::Contains("00:00:00.001 main thread spin waited 0.500 ms of 500.000 ms for a "
                                          "processor (the hypervisor withheld it 0.100 ms)"));
  EXPECT_EQ(verdict("main", "wait_ms"), "held");
}

/// Threads may wait 60 ms in a second; there are no bounds of chains.
class Tolerant : public Watching {
 protected:
  Tolerant() : Watching(contract()) {}
  static std::string contract() {
    std::string contract = kContract;
    contract.erase(contract.find("chains:"), contract.find("threads:") - contract.find("chains:"));
    return contract.replace(contract.find("wait_ms: {value: 1,"), 19, "wait_ms: {value: 60,");
  }
  void read(double ms, char state, Duration ran, Duration waited = {}) {
    ThreadFacts f = facts();
    f.state = state;
    f.ran = ran;
    f.waited = waited;
    observer.threads({f}, at_ms(ms));
  }
};

/// A cgroup lets the thread run for a millisecond in between.
TEST_F(Tolerant, BeginsWithAThreadThatWaitsLong) {
  system.run(10, 1);
  system.run(20, 194);
  for (int i = 0; i < 5; ++i) system.run(220 + 10 * i, 1);
  std::size_t next = 0;
  for (int ms = 1; ms < 260; ms += 20) {
    for (; next < system.events.size() && system.events[next].at <= at_ms(ms); ++next)
      observer.event(system.events[next]);
    observer.observed_until(at_ms(ms), losses);
    read(ms, 'S', from_ms(ms > 213 ? 4.5 : 2), from_ms(ms > 213 ? 192.5 : ms > 62 ? 40 : 0));
  }
  EXPECT_EQ(
      incident(),
      "00:00:00.068 main thread spin waited 152.500 ms of 152.500 ms for a processor, limit 60.000 ms in "
      "a second");
  EXPECT_THAT(others(),
              testing::Contains("00:00:00.022 source (timer) ran 194.000 ms, budget 2.000 ms (measured)"));
}

TEST_F(Tolerant, TakesAThreadThatSleepsOrRunsForNoStandstill) {
  system.run(10, 1);
  until(15);
  for (double ms = 20; ms <= 5000; ms += 20) read(ms, ms < 2500 ? 'S' : 'R', from_ms(ms < 2500 ? 0 : ms));
  EXPECT_EQ(incident(), "");
}

/// The thread has run a job; its facts are read.
class WatchingAThread : public Watching {
 protected:
  WatchingAThread() {
    system.run(10, 1);
    until(20);
  }
  void read(double ms) { observer.threads({spin}, at_ms(ms)); }
  ThreadFacts spin = facts();
};

TEST_F(WatchingAThread, AddsTheWaitsOfASecond) {
  for (int i = 0; i <= 20; ++i) {
    spin.waited = from_ms(0.15) * i;
    read(1 + 200 * i);
  }
  EXPECT_EQ(incident(), "") << "0.75 ms in a second";
  spin.waited += from_ms(0.9);
  read(4201);
  EXPECT_THAT(incident(), HasSubstr("00:00:04.001 main thread spin waited 0.900 ms of 200.000 ms"));
  read(4401);
  EXPECT_EQ(term("main", "wait_ms")["broken"], 1) << "each wait counts once";
}

TEST_F(WatchingAThread, ScalesAWaitBetweenReadingsThatAreFarApart) {
  read(1);
  spin.waited = from_ms(1.5);
  read(2001);
  EXPECT_EQ(incident(), "") << "0.75 ms in a second";
  spin.waited += from_ms(3);
  spin.stolen += from_ms(1000), spin.processor = 1;  // which has a counter of its own
  read(4001);
  EXPECT_THAT(incident(), HasSubstr("00:00:02.001 main thread spin waited 3.000 ms of 2000.000 ms"));
}

TEST_F(WatchingAThread, CountsNoWaitThatMayBeOlderThanTheThreadsJobsNorTheHypervisorsCounterAlone) {
  spin.waited = std::chrono::seconds(60);  // since the thread was created
  read(500);
  read(520);
  spin.stolen = from_ms(1000);
  read(1520);
  EXPECT_EQ(verdict("main", "wait_ms"), "held");
}

TEST_F(WatchingAThread, NamesChangesOfATimerThread) {
  ThreadFacts timers = spin;
  timers.thread = 8;
  timers.timers = true;
  timers.name = "hotpath_timers";
  timers.policy = parse_thread_policy("fifo:81");
  observer.threads({spin, timers}, at_ms(1));
  observer.threads({spin, timers}, at_ms(201));
  EXPECT_EQ(incident(), "");
  timers.policy = parse_thread_policy("other");
  observer.threads({spin, timers}, at_ms(401));
  EXPECT_THAT(incident(), HasSubstr("00:00:00.201 main thread hotpath_timers has the policy other instead of "
                                    "fifo:81"));
}

TEST_F(WatchingAThread, TakesAnInheritedNicenessForNoPolicy) {
  JudgedTerm& policy = *observer.judge().all(Kind::thread)[0].find(Clause::policy);
  policy = {{Clause::policy}, "main", observer.judge().incidents()};
  spin.policy = parse_thread_policy("other:5"), spin.inherited = true;
  read(1);
  EXPECT_EQ(verdict("main", "policy"), "held");
  spin.inherited = false;
  read(21);
  EXPECT_EQ(verdict("main", "policy"), "broken");
}

TEST_F(WatchingAThread, NamesItsChanges) {
  read(1);
  spin.policy = parse_thread_policy("other");
  spin.processors = {1};
  read(2001);
  EXPECT_THAT(term("main", "processors")["reason"],
              HasSubstr("main thread spin may run on processors 1, contract 1,2"));
}

/// The contract gives the thread's callbacks to no thread.
class WatchingAnotherThread : public Watching {
 protected:
  WatchingAnotherThread() : Watching(contract()) {}
  static std::string contract() {
    std::string text = kContract;
    text.replace(text.find("[source (timer), space.sink/a]"), 30, "[absent (timer)]");
    return text.insert(text.find("- node: source"), "- node: absent\n  publishes: []\n");
  }
};

TEST_F(WatchingAnotherThread, JudgesItNot) {
  system.run(10, 1);
  observe();
  ThreadFacts f;
  f.process = f.thread = 7;
  observer.threads({f}, at_ms(200));
  observer.threads({f}, at_ms(400));
  EXPECT_EQ(incident(), "");
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

TEST(LastingWaits, AreShownBeforeTheyEnd) {
  ThreadFacts facts{.process = 7, .thread = 7, .state = 'R', .ran = from_ms(3), .waited = from_ms(1)};
  LastingWaits waits;
  EXPECT_EQ(waits.with(facts, at_ms(0)), from_ms(1));
  EXPECT_EQ(waits.with(facts, at_ms(50)), from_ms(1)) << "it may have run";
  EXPECT_EQ(waits.with(facts, at_ms(500)), from_ms(501));
  facts.ran = from_ms(4), facts.waited = from_ms(499);
  EXPECT_EQ(waits.with(facts, at_ms(520)), from_ms(501)) << "the same wait, which has ended";
  facts.waited = from_ms(510), facts.state = 'S';
  EXPECT_EQ(waits.with(facts, at_ms(900)), from_ms(510));
  facts.started = 1;
  EXPECT_EQ(waits.with(facts, at_ms(900)), from_ms(510)) << "another thread of this id";
}

TEST(ThreadFactsOfProc, AreRead) {
  std::string text = "12 (a (b) c) S";
  for (int f = 4; f <= 38; ++f) text += f == 22 ? " 9" : " 0";
  ThreadFacts facts;
  EXPECT_TRUE(parse_stat(text + " 3 0", facts));
  EXPECT_EQ(facts.name, "a (b) c");
  EXPECT_EQ(facts.state, 'S');
  EXPECT_EQ(facts.started, 9U);
  EXPECT_EQ(facts.processor, 3);
  EXPECT_FALSE(parse_stat("12 (a) S 1", facts));
  EXPECT_FALSE(parse_stat("", facts));
  EXPECT_TRUE(parse_schedstat("100 7 3\n", facts));
  EXPECT_EQ(facts.ran, Duration(100));
  EXPECT_EQ(facts.waited, Duration(7));
  EXPECT_FALSE(parse_schedstat("100", facts));
}

}  // namespace hotpath::watch::thread_contract_test
