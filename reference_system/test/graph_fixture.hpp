// SPDX-License-Identifier: Apache-2.0
// Graphs and other files from texts, and the messages for mistakes in them.
#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

/// A file that is removed after the test.
class File {
 public:
  File(const std::string& name, const std::string& text)
      : path_(std::filesystem::temp_directory_path() / (std::to_string(getpid()) + name)) {
    std::ofstream(path_) << text;
  }
  ~File() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// A folder that is removed after the test.
class Folder {
 public:
  Folder() {
    if (mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no folder");
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::filesystem::path path() const { return path_; }

 private:
  std::string path_ = std::filesystem::temp_directory_path() / "hotpath_XXXXXX";
};

inline Graph load(const std::string& text) { return load_graph(File("graph.yaml", text).path()); }

/// A graph with every key; of those of timers, graph_writer_test tries each.
inline const std::string kEverything = R"(name: everything
description: "all that a graph can say: # it"
work: fixed
service_wait_ms: 12.5
ros_distro: humble
topics: {t: {publishers: many}, a: {delivery: [K, X, F]}, b: {delivery: unknown, intra_process: true}}
platform: {cores: 2, timer_thread: equal, execution_times: uniform, release_cost_us: 12.5, pass_cost_us: 3, subscription_dispatch_cost_us: 7, timer_dispatch_cost_us: 0.001, dispatch_cost_us: 0.001, wait_cost_us: 41, wait_cost_per_entity_us: 0.025, wake_up_us: 190, delivery_delay_us: 1000, measured_delivery_us: 0.5, median_delivery_us: 0.25, delivery_samples: 1204}
nodes:
- {name: S, type: sensor, period_ms: 12.5, phase_ms: 0.25, deadline_ms: 7, release_jitter_ms: 1.5, priority: -3, output: t, execution_time_ms: 2, best_case_execution_time_ms: 0.000001, callback_group: reentrant}
- {name: C, type: cyclic, period_ms: 20, inputs: [{topic: t, depth: 4, priority: 2}], callback_group: reentrant}
- {name: I, type: intersection, connections: [{input: {topic: t, depth: 5, priority: 9}, output: a}, {input: C, output: b}]}
- {name: F, type: fusion, inputs: [a, {topic: b, depth: 2}], output: t2}
- {name: X, type: command, input: {topic: a, depth: 1}}
- {name: Y, type: command, input: b}
- {name: W, type: callbacks, callbacks: [{subscription: l, waitable: true}]}
- name: K
  type: callbacks
  groups: {g: reentrant, h: mutually_exclusive}
  callbacks:
  - {timer: one, period_ms: 100, phase_ms: 3, deadline_ms: 50, release_jitter_ms: 7, priority: 1, execution_time_ms: {min: 1, max: 2.5}, group: h, publishes: [t, {topic: k, last_of: [b, a]}]}
  - {subscription: a, depth: 3, service: true, execution_time_ms: {measured: [3, 1, 2]}, group: g, publishes: {topic: k, when: all_new, of: [a, b]}}
  - {subscription: b, client: true, execution_time_ms: {min: 1, p50: 2, p95: 2.5, p99: 4, max: 9}, publishes: [{topic: l, every: 4, first: 2, at_percent: 33.3}, {topic: m, at_percent: 0}]}
chains:
- {name: c, nodes: [I, S, K/a], sources: [S], sink: K/a}
)";

/// The message of `read(path)` for a file with this text, without the path: `:LINE: ...`; empty if the file
/// is accepted.
inline std::string error_of(const std::string& text, const auto& read) {
  const File file("mistaken", text);
  try {
    static_cast<void>(read(file.path()));
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_THAT(message, testing::HasSubstr("; ")) << "names no remedy";
    return message.starts_with(file.path()) ? message.substr(file.path().size()) : message;
  }
  return "";
}
inline std::string error_of(const std::string& text) {
  return error_of(text, [](const std::string& path) { return load_graph(path); });
}

/// The task with this name.
inline TaskId task_named(const GraphTasks& tasks, const std::string& name) {
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].name == name) return id;
  }
  ADD_FAILURE() << "no task " << name;
  return 0;
}

constexpr int kAnyLine = 0;

struct Mistake {
  std::string text;
  int line;
  std::vector<const char*> parts = {};  ///< Of the message.
};

/// Expects a message `:LINE: ...` that has these parts.
inline void expect_error(const std::string& message, int line, const std::vector<const char*>& parts = {}) {
  EXPECT_NE(message, "") << "accepted";
  if (line != kAnyLine) {
    EXPECT_THAT(message, testing::StartsWith(":" + std::to_string(line) + ": "));
  }
  for (const char* part : parts) EXPECT_THAT(message, testing::HasSubstr(part));
}

}  // namespace hotpath
