// SPDX-License-Identifier: Apache-2.0
// Bounds beside the observations of a stored run.
#include "bounds/bound_report.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>

#include "results/run_folder.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;
using testing::UnorderedElementsAre;

class BoundReportTest : public testing::Test {
 protected:
  BoundReportTest() {
    for (const char* name : {"A", "B"}) {
      Task& timer = set_.tasks.emplace_back();
      timer.name = name;
      timer.period = timer.deadline = 10ms;
    }
    base_ = std::filesystem::temp_directory_path() / "hotpath_XXXXXX";
    if (mkdtemp(base_.data()) == nullptr) throw std::runtime_error("no folder");
    store();
    results::StoredRun run(base_ + "/run", "--trace");
    observed_.emplace(run, set_);
  }
  ~BoundReportTest() override { std::filesystem::remove_all(base_); }

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
    results::RunFolder folder(base_ + "/run");
    folder.append(set_, {"c"}, trace);
    results::RunRecord record;
    record.simulation.emplace();
    record.tasks = set_;
    record.executors = {"default"};
    record.chains = {"c"};
    folder.close(record, nlohmann::json::object());
  }

  static GraphBounds bounds(Duration a, Duration b) {
    GraphBounds all;
    all.method = "method";
    all.tasks = {a.count(), b.count()};
    return all;
  }

  std::string printed(const GraphBounds& bounds) {
    report_.emplace(set_, observed_, out_);
    out_.str("");
    report_->print("default", {}, bounds);
    return out_.str();
  }

  std::string base_;
  TaskSet set_;
  std::optional<bounds::Observed> observed_;
  std::ostringstream out_;
  std::optional<bounds::Report> report_;
};

TEST_F(BoundReportTest, UnknownAgesAreNoObservations) {
  EXPECT_THAT(observed_->of({"chain", "default", "c"}), UnorderedElementsAre(7'000'000));
  EXPECT_THAT(observed_->of({"hot_path", "default", "c"}), UnorderedElementsAre(2'000'000, 3'000'000));
  EXPECT_THAT(observed_->of({"task", "default", "B"}), UnorderedElementsAre(4'000'000, 6'000'000));
}

TEST_F(BoundReportTest, AReachedBoundIsNotViolated) {
  EXPECT_THAT(printed(bounds(6ms, 7ms)), Not(HasSubstr("VIOLATED")));
  EXPECT_EQ(report_->compared(), 4U);
  EXPECT_EQ(report_->violations(), 0U);
  EXPECT_THAT(printed(bounds(6ms, 6ms - 1ns)), HasSubstr("VIOLATED"));
  EXPECT_EQ(report_->violations(), 1U);
  EXPECT_EQ(report_->first_violation(), "task B under default by method");
}

TEST_F(BoundReportTest, TheFirstViolationIsNamed) {
  printed(bounds(5ms, 3ms));
  EXPECT_EQ(report_->violations(), 3U);
  EXPECT_EQ(report_->first_violation(), "task A under default by method");
}

TEST_F(BoundReportTest, ABoundUpToTheDeadlineShowsSchedulability) {
  EXPECT_THAT(printed(bounds(10ms, 6ms)), HasSubstr("Schedulable: every timer"));
  EXPECT_THAT(printed(bounds(6ms, 10ms + 1ns)), HasSubstr("not shown: B may exceed its deadline"));
  GraphBounds none = bounds(6ms, 6ms);
  none.tasks[0].reset();
  EXPECT_THAT(printed(none), HasSubstr("not shown: A may exceed"));
}

}  // namespace
}  // namespace hotpath
