// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hotpath/analysis/processing_windows.hpp"
#include "hotpath/analysis/teper_2024.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "task_sets.hpp"

namespace hotpath::default_executor_test {

using ::testing::ElementsAre;

TEST(Teper2024, LatenciesOfThePaperArtifact) {
  EXPECT_THAT(teper_2024_timers({task(1, 10), task(2, 20), task(4, 20), task(8, 50), task(16, 100)}),
              ElementsAre(41, 52, 54, 88, 146));
  EXPECT_THAT(teper_2024_timers({task(30, 10), task(2, 20)}), ElementsAre(62, 82));
}

TEST(Teper2024, PaperTaskSetsWithoutOverhead) {
  const auto in_ms = [](int utilisation) {
    std::vector<std::int64_t> latency = teper_2024_timers(paper_timers_only(utilisation));
    for (std::int64_t& l : latency) l /= kMs;
    return latency;
  };
  EXPECT_THAT(in_ms(60), ElementsAre(91, 146, 156, 166, 176, 302, 312));
  EXPECT_THAT(in_ms(80), ElementsAre(107, 162, 176, 190, 204, 334, 344));
  EXPECT_THAT(in_ms(90), ElementsAre(115, 170, 186, 202, 218, 350, 360));
}

TEST(ProcessingWindows, ASampleThatIsDeliveredLateMayMissAWindow) {
  CallbackGraph graph;
  graph.set.tasks.resize(2);
  Task &timer = graph.set.tasks[0], &subscription = graph.set.tasks[1];
  timer.period = timer.deadline = Duration(1000);
  timer.wcet = Duration(2);
  timer.feeds = {1};
  subscription.kind = TaskKind::subscription;
  subscription.wcet = Duration(3);
  graph.reads.resize(2);
  graph.every.assign(2, 1);
  const GraphTopology topology(graph);
  GraphOverheads overheads;
  EXPECT_EQ(processing_windows(topology, {}, overheads)->response(1), 3 + 2 + 3);
  overheads.delivery = 100;
  EXPECT_EQ(processing_windows(topology, {}, overheads)->response(1), 100 + 5 + 2 + 3);
  overheads.wait = 1;  // before a window, and behind the decision for the timer
  EXPECT_EQ(processing_windows(topology, {}, overheads)->until_finish(0, 0), 1 + 5 + 2 + 1);
}

TEST(SectionVIIB, NormalisedReductionOfThePaperArtifact) {
  const std::vector<std::int64_t> latency =
      teper_2024_timers({task(1, 10), task(2, 20), task(4, 20), task(8, 50), task(16, 100)});
  const std::int64_t periodic[] = {27, 40, 47, 90, 140};
  const struct {
    TaskChain chain;
    double percent;
  } rows[] = {
      {{0, 1}, 27.9570}, {{4, 3, 0}, 6.5455}, {{0, 1, 2, 3, 4}, 9.7113}, {{2, 0}, 22.1053}, {{4, 4}, 4.1096}};
  for (const auto& row : rows) {
    double e_default = 0, e_rm = 0;
    for (const std::size_t i : row.chain) {
      e_default += static_cast<double>(latency[i]);
      e_rm += static_cast<double>(periodic[i]);
    }
    EXPECT_NEAR(100 * (e_default - e_rm) / e_default, row.percent, 5e-5);
  }
}

}  // namespace hotpath::default_executor_test
