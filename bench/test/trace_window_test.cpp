// SPDX-License-Identifier: Apache-2.0
#include "results/trace_window.hpp"

#include <gmock/gmock.h>

#include <sstream>

#include "graph_fixture.hpp"
#include "hotpath/core/trace_csv.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;

/// The tasks of the rows that lie in the window [from, to), in milliseconds.
std::string tasks_in(Duration from, Duration to) {
  TaskSet set;
  Trace trace;
  trace.executor = "default";
  const auto add = [&](const char* name, Duration ready, Duration start, Duration finish, Outcome outcome) {
    trace.jobs.push_back({{set.size(), 0, Time{} + ready, Time{} + ready, kNever, {}},
                          Time{} + start,
                          Time{} + finish,
                          Duration(-1),
                          outcome});
    set.tasks.emplace_back().name = name;
  };
  add("waits", 0ms, 12ms, 13ms, Outcome::ran);
  add("ends", 0ms, 1ms, 10ms, Outcome::ran);
  add("over", 0ms, 1ms, 9ms, Outcome::ran);
  add("late", 20ms, 20ms, 21ms, Outcome::ran);
  add("open", 2ms, 3ms, 0ms, Outcome::running);
  add("lost", 15ms, 0ms, 0ms, Outcome::overwritten);
  std::ostringstream rows, window;
  rows << kJobsCsvHeader << '\n';
  write_jobs_csv(rows, set, trace);
  trace.repetition = 1;
  write_jobs_csv(rows, set, trace);
  const File file("jobs.csv", rows.str());
  results::write_window(window, file.path(), {"default", 0, Time{} + from, Time{} + to});
  std::istringstream lines(window.str());
  std::string names;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find(',', line.find(',') + 1) + 1;
    names += (names.empty() ? "" : " ") + line.substr(begin, line.find(',', begin) - begin);
  }
  return names;
}

TEST(TraceWindow, HasTheJobsThatWereReadyOrRunningInIt) {
  EXPECT_EQ(tasks_in(10ms, 20ms), "task waits ends open lost");
  EXPECT_EQ(tasks_in(11ms, 15ms), "task waits open");
  EXPECT_EQ(tasks_in(0ms, 1ms), "task waits ends over");
  EXPECT_EQ(tasks_in(20ms, 21ms), "task late open");
}

}  // namespace
}  // namespace hotpath
