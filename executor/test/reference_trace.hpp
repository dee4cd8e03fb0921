// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/trace.hpp"

namespace hotpath::test {

/// One job of the real ROS 2 stack.
struct ReferenceJob {
  TaskId task;
  std::uint64_t count;
  Time start, end;
  Time next_call;  ///< The timer's next call as read at the start of the callback.
};

/// A golden trace: results/ros2_reference/traces/<set>.<executor>.csv.
struct ReferenceTrace {
  TaskSet set;
  std::vector<ReferenceJob> jobs;  ///< By start.
};

inline ReferenceTrace read_reference_trace(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + " cannot be read");
  ReferenceTrace trace;
  std::map<std::string, TaskId> ids;
  std::string line;
  while (std::getline(in, line)) {
    if (line.starts_with('#')) {
      std::istringstream words(line.substr(1));
      Task t;
      std::string key;
      std::int64_t period = 0, wcet = 0, phase = 0;
      words >> t.name >> key >> period >> key >> wcet >> key >> phase;
      t.period = t.deadline = Duration(period);
      t.wcet = t.bcet = Duration(wcet);
      t.phase = Duration(phase);
      ids[t.name] = trace.set.size();
      trace.set.tasks.push_back(t);
      continue;
    }
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::string name;
    std::int64_t count = 0, start = 0, end = 0, next = 0;
    if (!(words >> name >> count >> start >> end >> next)) throw std::runtime_error(path + ": " + line);
    trace.jobs.push_back(
        {ids.at(name), static_cast<std::uint64_t>(count), from_ns(start), from_ns(end), from_ns(next)});
  }
  std::sort(trace.jobs.begin(), trace.jobs.end(),
            [](const ReferenceJob& a, const ReferenceJob& b) { return a.start < b.start; });
  return trace;
}

}  // namespace hotpath::test
