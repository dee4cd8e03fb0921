// SPDX-License-Identifier: Apache-2.0
// What the absence of events shows: silence, overdue jobs, and nothing after a loss of events.
#include <gmock/gmock.h>

#include "watching.hpp"

namespace hotpath::watch::absence_test {

using testing::HasSubstr;
using K = tracing::EventKind;

TEST_F(Watching, SeesABurst) {
  system.run(10, 1);
  system.run(12.5, 1);
  until(20);
  EXPECT_THAT(incident(),
              HasSubstr("space.sink/a got samples at a distance of 2.500 ms, minimum distance 7.000"));
}

TEST_F(Watching, SeesLostSamples) {
  for (int i = 1; i <= 4; ++i) system.run(10 * i, 1, i == 4);  // depth 2
  until(50);
  EXPECT_EQ(verdict("space.sink/a", "lost"), "broken");
  EXPECT_THAT(incident(), HasSubstr("space.sink/a lost samples: 1, bound 0 (derived)"));
}

TEST_F(Watching, TakesTheEndOfProgramsForNoLossOfSamples) {
  system.run(10, 1);
  observe();
  observer.end();
  for (int i = 2; i <= 5; ++i) system.run(10 * i, 1, false);  // depth 2
  until(60);
  EXPECT_EQ(incident(), "");
}

TEST_F(Watching, LimitsTheSamplesOfSeveralActivations) {
  for (const double start : {10.0, 17.5, 25.5}) system.run(start, 1);
  until(30);
  EXPECT_THAT(term("space.sink/a", "minimum_distance_ms")["reason"],
              HasSubstr("got 3 samples within 15.500 ms, minimum distance 17.000 ms"));
}

/// The sink's queue is long; its samples are at most 13 ms apart.
class WatchingASlowSink : public Watching {
 protected:
  WatchingASlowSink() : Watching(slow()) { system.events[6].number[3] = 100; }
  static std::string slow() {
    std::string contract = kContract;
    return contract.insert(contract.find("  lost:"), "  maximum_distance_ms: {value: 13, from: derived}\n");
  }
  nlohmann::json distance() { return term("space.sink/a", "maximum_distance_ms"); }
};

TEST_F(WatchingASlowSink, TakesUnreadSamplesForNoSilence) {
  system.run(10, 1);
  for (int i = 2; i <= 30; ++i) {
    system.run(10 * i, 1, false);
    until(10 * i + 2);
  }
  for (std::uint64_t i = 2; i <= 30; ++i) system.take(302 + static_cast<double>(i) / 5, i, 0.1);
  until(310);
  EXPECT_EQ(distance()["verdict"], "held") << distance();
  EXPECT_EQ(distance()["checked"], 29);
}

TEST_F(WatchingASlowSink, SeesSilenceAfterUnreadSamples) {
  for (int i = 1; i <= 3; ++i) system.run(10 * i, 1, i == 1);
  system.add(K::callback_start, 40, {11});  // publishes late
  until(150);
  EXPECT_EQ(distance()["broken"], 1);
  system.take(160, 2, 0.1);
  system.take(161, 3, 0.1);
  system.add(K::rcl_publish, 170, {13, 99});
  system.add(K::rmw_publish, 170, {14, 99, 4});
  system.take(171, 4, 0.1);
  until(180);
  EXPECT_EQ(distance()["broken"], 1);
  EXPECT_EQ(distance()["observed"], 139.0);
}

TEST_F(WatchingASlowSink, MeasuresNoDistanceFromAnOldSample) {
  for (int i = 1; i <= 5; ++i) system.run(10 * i, 1);
  system.take(52.5, 777, 0.1);  // published 777 ns after the beginning
  system.run(60, 1);
  until(65);
  EXPECT_EQ(distance()["verdict"], "held") << distance();
}

TEST_F(Watching, SeesACallbackThatDoesNotEnd) {
  system.add(K::callback_start, 10, {11});
  until(2010);
  EXPECT_THAT(
      incident(),
      HasSubstr("00:00:00.012 source (timer) has run for 2000.000 ms without an end, budget 2.000 ms"));
  until(3010);
  EXPECT_EQ(term("source (timer)", "budget_ms")["broken"], 1) << "once for each job";
}

TEST_F(Watching, TakesABoundAtTheEndOfALongJobForItsConsequence) {
  system.add(K::callback_start, 10, {11});
  until(100);
  system.add(K::callback_end, 5010, {11});
  system.job(5010, 3, 21);
  until(5100);
  EXPECT_EQ(incidents().size(), 1U) << observer.judge().json(false)["incidents"];
  EXPECT_EQ(incidents().front().json()["breaches"], 3U) << "the budgets of both, and silence";
  EXPECT_THAT(incident(), HasSubstr("00:00:00.012 source (timer) ran 5000.000 ms"));
}

TEST_F(Watching, KeepsTheLengthsOfJobsThatAreOverdueTogetherApart) {
  const auto of_thread_8 = [&](K kind, double ms) {
    system.add(kind, ms, {11});
    system.events.back().thread = 8;
  };
  system.add(K::callback_start, 10, {11});
  until(110);
  of_thread_8(K::callback_start, 120);
  until(1110);
  of_thread_8(K::callback_end, 1111);  // it has displaced the other one for 991 ms
  system.add(K::callback_end, 1115, {11});
  until(1220);
  EXPECT_THAT(incident(), HasSubstr("00:00:00.012 source (timer) ran 114.000 ms"));
}

TEST_F(Watching, CountsNoTimeInWhichAnotherJobHadTheProcessor) {
  system.add(K::callback_start, 10, {11});
  for (const auto& [kind, ms] : {std::pair(K::callback_start, 11.0), std::pair(K::callback_end, 11.9)}) {
    system.add(kind, ms, {21});
    system.events.back().thread = 8;
  }
  system.add(K::callback_end, 12.5, {11});
  until(20);
  EXPECT_EQ(verdict("source (timer)", "budget_ms"), "held");
  EXPECT_EQ(verdict("space.sink/a", "budget_ms"), "held");
}

TEST_F(Watching, ConcludesNothingFromLostEvents) {
  system.run(10, 1);
  losses = 1;
  until(5000);
  system.run(6000, 1);
  until(6010);
  EXPECT_EQ(incident(), "");
  for (int i = 601; i <= 1400; ++i) system.run(10 * i, 1);
  until(14'010);
  EXPECT_EQ(incident(), "");
  until(15'000);
  EXPECT_THAT(incident(), HasSubstr("got nothing for")) << "it goes on after some seconds";
}

TEST_F(Watching, ConcludesNothingFromEventsThatCameWithTheLoss) {
  system.run(10, 1);
  until(20);
  observer.note_losses(1, at_ms(60));
  for (int i = 4; i <= 7; ++i) system.run(10 * i, 1, false);  // the takes were lost, and a job at 20 ms
  observe();
  losses = 1;
  until(80);
  EXPECT_EQ(incident(), "");
}

TEST_F(Watching, ExtendsNoSilenceThatEndedWhileEventsWereLost) {
  system.run(10, 1);
  until(45);
  losses = 1;
  until(1000);
  system.run(1010, 1);
  until(1200);
  EXPECT_THAT(incident(), HasSubstr("source (timer) got nothing for 35.000 ms"));
}

TEST_F(Watching, BeginsWithAProcessThatIsGone) {
  system.run(10, 1);
  system.run(20, 3);
  until(30);
  EXPECT_THAT(incident(), HasSubstr("source (timer) ran 3.000 ms"));
  observer.forget({7, 0});
  until(1000);
  EXPECT_THAT(incident(), HasSubstr("source (timer) ran 3.000 ms")) << "the others may be about to end";
  until(1600);
  EXPECT_EQ(incident(), "00:00:00.024 nodes source, space.sink are gone: their process 7 has ended");
}

TEST_F(Watching, TakesTheEndOfTheLastProcessByItselfForNone) {
  system.run(10, 1);
  until(30);
  observer.forget({7, 0}, false);
  until(5000);
  EXPECT_THAT(incident(), HasSubstr("source (timer) got nothing for"));
}

/// A timer that publishes to a subscription, and a service, which all run until a fault.
class Faulty : public Watching {
 public:
  Faulty() : Watching(contract()) { system.create_service(0, 30, 1, "/reset"); }
  static std::string contract() {
    std::string text = kContract;
    text.insert(text.find("  lost:"), "  maximum_distance_ms: {value: 13, from: derived}\n");
    return text.insert(text.find("- node: space.sink"),
                       "- node: source\n  service: reset\n  maximum_distance_ms: {value: 60, from: given}\n");
  }
  /// A cycle of 10 ms.
  void cycle() {
    const double at = 10.0 * ++cycles;
    if (timer && publishes) system.run(at, length, taken);
    if (timer && !publishes) system.job(at, 1, 11);
    for (std::size_t e = observed; e < system.events.size(); ++e)
      if (system.events[e].kind == K::rmw_take || system.events[e].number[0] == 21)
        system.events[e].process = system.events[e].thread = process_of_sink;
    if (service && cycles % 5 == 0) system.job(at + 6, 0.5, 31);
    until(at + 9);
    if (timer) spin.ran += from_ms(2);
    if (!timer) spin.state = stands, spin.waited = from_ms(at - 2000);
    observer.threads({spin}, at_ms(at + 9));
    observer.set_realtime(clock, at_ms(at + 9));
  }
  int cycles = 0;
  std::uint32_t process_of_sink = 7;
  bool timer = true, publishes = true, taken = true, service = true;
  double length = 1;
  char stands = 'R';
  Duration clock{};
  ThreadFacts spin = facts();
};

struct Fault {
  const char* sentence;
  void (*plant)(Faulty&);
  bool at_start = false;
};
using F = Faulty&;
const Fault kFaults[] = {
    {"nodes source, space.sink are gone: their process 7 has ended",
     [](F f) {
       f.timer = f.service = false, f.observer.forget({7, 0});
     }},
    {"space.sink/a has never run: its node has no such callback, but subscribes to /b",
     [](F f) { f.taken = false, f.system.events[6].text[0] = "/b"; }, true},
    {" samples were published, as if QoS settings did not match", [](F f) { f.taken = false; }, true},
    {"space.sink/a has never run: nothing was published for it", [](F f) { f.publishes = false; }, true},
    {"space.sink/a got nothing for ", [](F f) { f.publishes = false; }},
    {"source (timer) has a period of 11.000 ms, period 10.000 ms",
     [](F f) { f.system.events[2].number[1] = 11'000'000; }, true},
    {"source (timer) ran 3.000 ms, budget 2.000 ms", [](F f) { f.length = 3; }},
    {"main thread spin has run nothing for 15", [](F f) { f.timer = f.service = false; }},
    {" ms, because it is stopped", [](F f) { f.timer = f.service = false, f.stands = 'T'; }},
    {"main thread spin has the policy other instead of fifo:80",
     [](F f) { f.spin.policy = parse_thread_policy("other"); }},
    {"the clock was set back by 500.000 ms", [](F f) { f.clock -= from_ms(500); }},
    {"space.sink/a has not run for ", [](F f) { f.taken = false; }},
    {"source/reset (service) got nothing for ", [](F f) { f.service = false; }},
};

class FaultyCase : public Faulty, public testing::WithParamInterface<Fault> {};

TEST_P(FaultyCase, IsNamedFirst) {
  const Fault& fault = GetParam();
  if (fault.at_start) fault.plant(*this);
  while (cycles < 200) cycle();
  if (!fault.at_start) {
    ASSERT_EQ(incident(), "");
    fault.plant(*this);
  }
  while (cycles < 1500) cycle();
  EXPECT_THAT(incident(), HasSubstr(fault.sentence));
  EXPECT_EQ(verdict("space.sink/a", "lost"),
            fault.at_start && (!taken || !publishes) ? "not observable" : "held")
      << "none was taken";
}

TEST_F(Faulty, MissesNoServiceThatDiscoveryMayNotHaveReached) {
  service = false;
  process_of_sink = 8;  // that of the service hears nothing from it
  for (std::size_t e = 5; e < 9; ++e) system.events[e].process = system.events[e].thread = 8;
  while (cycles < 900) cycle();
  EXPECT_EQ(incident(), "");
  while (cycles < 1100) cycle();
  EXPECT_THAT(incident(), HasSubstr("source/reset (service) has never run"));
}

INSTANTIATE_TEST_SUITE_P(All, FaultyCase, testing::ValuesIn(kFaults));

}  // namespace hotpath::watch::absence_test
