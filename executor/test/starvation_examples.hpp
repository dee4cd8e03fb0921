// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "task_sets.hpp"

namespace hotpath::test {

/// Periods, work and callback groups of the timers; the executor has two threads.
struct Example {
  int number;
  std::vector<Duration> periods, work;
  std::vector<std::uint32_t> groups;
};

inline const std::vector<Example> kExamples = {
    {4, {1s, 1s, 1s}, {1s, 500ms, 500ms}, {0, 0, 1}},
    {5, {1s, 1s, 1s, 1s}, {500ms, 500ms, 500ms, 1ms}, {0, 1, 2, 2}},
    {6, {1s, 1s, 500ms, 5s}, {333ms, 333ms, 334ms, 1ms}, {0, 1, 2, 2}},
};

/// Scales all times down by this factor.
inline TaskSet make_set(const Example& example, int faster = 1) {
  TaskSet set;
  for (std::size_t i = 0; i < example.periods.size(); ++i) {
    // A timer's first release is one period after its creation; the next timer is created a little
    // later.
    const TaskId id = add_timer(set, example.periods[i] / faster, example.work[i] / faster,
                                example.periods[i] / faster + static_cast<int>(i) * 50us);
    set.tasks[id].group = example.groups[i];
  }
  return set;
}

}  // namespace hotpath::test
