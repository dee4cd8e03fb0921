// SPDX-License-Identifier: Apache-2.0
// The exploration of schedules against values of a schedule-abstraction graph (Nasri, Brandenburg: "An exact
// and sustainable analysis of non-preemptive scheduling", RTSS 2017).
#include <gmock/gmock.h>

#include "hotpath/analysis/wcrt_table.hpp"
#include "hotpath/core/exploration.hpp"
#include "hotpath/core/registry.hpp"
#include "task_sets.hpp"

namespace hotpath::schedule_abstraction_test {

/// The worst response times for the phases of the tasks, whose order is that of their priorities.
class ExploredResponses final : public ExplorationObserver {
 public:
  explicit ExploredResponses(const PeriodicTasks& tasks) : worst(tasks.size()) {
    TaskSet set;
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      set.tasks.push_back(as_timer(tasks[i], std::to_string(i)));
      set.tasks.back().priority = static_cast<std::int64_t>(i);
    }
    const WorstCaseTimes times(set);
    explore(set, *find_executor("fp-ro")->make(set, {}), PublishingWorkload(times), {}, *this);
  }

  void ended(const JobRecord& record, ExploredInstant& instant) override {
    std::int64_t& largest = worst[record.job.task];
    largest = std::max(largest, (instant.latest() - record.job.timestamp).count());
  }

  std::vector<std::int64_t> worst;
};

TEST(NasriBrandenburg2017, PaperTaskSetsWithExecutionTimesFromZero) {
  const struct {
    int utilisation;
    std::vector<std::int64_t> us;
  } rows[] = {{60, {12665, 23498, 34331, 45164, 57830, 57831, 68664}},
              {90, {18665, 29498, 46331, 64997, 81830, 83664, 94497}}};
  for (const auto& row : rows) {
    PeriodicTasks tasks = paper_timers_only(row.utilisation);
    for (PeriodicTask& t : tasks) {
      t.period /= kUs;
      t.deadline /= kUs;
      t.wcet = t.wcet / kUs + 833;
      t.bcet = 0;
    }
    EXPECT_EQ(ExploredResponses(tasks).worst, row.us) << row.utilisation;
  }
}

}  // namespace hotpath::schedule_abstraction_test
