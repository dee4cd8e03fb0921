// SPDX-License-Identifier: Apache-2.0
// Graphs and other files from texts, and the messages for mistakes in them.
#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
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

inline Graph load(const std::string& text) { return load_graph(File("graph.yaml", text).path()); }

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
inline std::string error_of(const std::string& text) { return error_of(text, load_graph); }

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
