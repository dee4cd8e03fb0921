// SPDX-License-Identifier: Apache-2.0
// Bounds beside the observations of a stored run.
#include "guarantees/analyze.hpp"

#include <gmock/gmock.h>

#include <sstream>

#include "graph_fixture.hpp"
#include "results/run_folder.hpp"

namespace hotpath::bound_rows_test {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

class BoundRowsTest : public testing::Test {
 protected:
  BoundRowsTest() {
    for (const char* name : {"A", "B"}) {
      Task& timer = graph_.set.tasks.emplace_back();
      timer.name = name;
      timer.period = timer.deadline = 10ms;
    }
    store();
  }

  /// A run whose jobs respond after 4 and 6 ms, with one output of unknown age.
  void store() {
    Trace trace;
    trace.executor = "default";
    for (const TaskId task : {0U, 1U}) {
      for (int i = 0; i < 2; ++i) {
        JobRecord& r = trace.jobs.emplace_back();
        r.job.task = task;
        r.job.sequence = static_cast<std::uint64_t>(i);
        r.job.timestamp = r.job.release = Time{} + i * 10ms;
        r.start = r.job.timestamp + 1ms;
        r.finish = r.job.timestamp + (i == 0 ? 4ms : 6ms);
      }
    }
    trace.chains = {{0, 0, 0, Duration(2ms), Duration(7ms)}, {0, 1, 0, Duration(3ms), Duration(-1)}};
    results::RunFolder folder(folder_.path() / "run");
    folder.append(graph_.set, {"c"}, trace);
    results::RunRecord record;
    record.simulation.emplace();
    record.tasks = graph_.set;
    record.executors = {"default"};
    record.chains = {"c"};
    folder.close(record, nlohmann::json::object());
  }

  guarantees::Observed observed() const {
    results::StoredRun run(folder_.path() / "run", "--trace");
    return {run, graph_.set};
  }

  /// What is printed of these bounds of A and B beside the run.
  std::string printed(std::optional<Duration> a, Duration b, guarantees::Observed& observed) const {
    GraphBounds bounds;
    bounds.method = "method";
    bounds.tasks = {a ? std::optional(a->count()) : std::nullopt, b.count()};
    std::vector<guarantees::BoundRow> rows = guarantees::bound_rows({.executor = "default"}, graph_, bounds);
    for (guarantees::BoundRow& row : rows) observed.compare(row);
    std::ostringstream out;
    print(out, rows, true);
    return out.str();
  }

  const Folder folder_;
  CallbackGraph graph_;
};

TEST_F(BoundRowsTest, UnknownAgesAreNoObservations) {
  const guarantees::Observed of_run = observed();
  EXPECT_THAT(of_run.of(Latency::age, "default", "c"), UnorderedElementsAre(7'000'000));
  EXPECT_THAT(of_run.of(Latency::hot_path, "default", "c"), UnorderedElementsAre(2'000'000, 3'000'000));
  EXPECT_THAT(of_run.of(Latency::response, "default", "B"), UnorderedElementsAre(4'000'000, 6'000'000));
}

TEST_F(BoundRowsTest, ABoundIsViolatedByWhatExceedsIt) {
  struct Case {
    std::optional<Duration> a;
    Duration b;
    std::size_t compared, violations;
    const char *first, *verdict;
  };
  const std::vector<Case> cases = {{6ms, 7ms, 4, 0, "", "Schedulable: every timer"},
                                   {6ms, 6ms - 1ns, 4, 1, "task B under default by method", "VIOLATED"},
                                   {5ms, 3ms, 4, 3, "task A under default by method", "VIOLATED"},
                                   {10ms, 6ms, 4, 0, "", "Schedulable: every timer"},
                                   {6ms, 10ms + 1ns, 4, 0, "", "not shown: B may exceed its deadline"},
                                   {std::nullopt, 6ms, 2, 0, "", "not shown: A may exceed"}};
  for (const Case& c : cases) {
    guarantees::Observed of_run = observed();
    const std::string text = printed(c.a, c.b, of_run);
    EXPECT_THAT(text, HasSubstr(c.verdict));
    EXPECT_EQ(text.find("VIOLATED") != std::string::npos, c.violations > 0) << text;
    EXPECT_EQ(of_run.compared, c.compared);
    EXPECT_EQ(of_run.violations, c.violations);
    EXPECT_EQ(of_run.first_violation, c.first);
  }
}

}  // namespace hotpath::bound_rows_test
