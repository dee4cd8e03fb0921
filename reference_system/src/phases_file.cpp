// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "graph_text.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath {

namespace {

const std::string kWidePrefix = "created_ms_";
const std::string kTraceHeader = "# ";

struct Row {
  int line = 0;
  std::vector<std::string> fields;
};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::size_t begin = 0;
  while (begin <= line.size()) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return fields;
}

class PhasesFile {
 public:
  PhasesFile(const std::string& path, const Graph& graph) : path_(path), tasks_(make_tasks(graph)) {
    for (const Task& task : tasks_.set.tasks) {
      if (task.kind == TaskKind::timer) timers_.push_back(task.name);
    }
    first_.resize(tasks_.set.size());
    known_.resize(tasks_.set.size(), 0);
    read_rows();
  }

  std::vector<Duration> read(const std::string& executor) {
    const std::vector<std::string>& columns = header_.fields;
    if (columns.front().starts_with(kTraceHeader)) {
      read_trace_header();
    } else if (columns == std::vector<std::string>{"task", "first_release_ms"}) {
      read_tasks(false);
    } else if (columns == std::vector<std::string>{"task", "created_ms"}) {
      read_tasks(true);
    } else if (std::find(columns.begin(), columns.end(), "executor") != columns.end()) {
      read_executor(executor);
    } else {
      fail(header_.line, "these columns are no phases",
           "begin with `task,first_release_ms`, `task,created_ms`, or columns `executor` and "
           "`created_ms_NODE`");
    }
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      if (tasks_.set[id].kind == TaskKind::timer && known_[id] == 0) {
        fail(last_line_, "no phase for the timer of node " + tasks_.set[id].name, "give one for each timer");
      }
    }
    return std::move(first_);
  }

 private:
  [[noreturn]] void fail(int line, const std::string& problem, const std::string& remedy) const {
    throw GraphError(path_, line, problem, remedy);
  }

  void read_rows() {
    std::ifstream in(path_);
    if (!in || std::filesystem::is_directory(path_)) {
      fail(0, "the file of phases cannot be read", "give the path of a readable CSV file");
    }
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
      if (text.ends_with('\r')) text.pop_back();
      // Of a golden trace only the header counts.
      if (!rows_.empty() && rows_.front().fields.front().starts_with(kTraceHeader) &&
          !text.starts_with(kTraceHeader)) {
        break;
      }
      if (text.empty()) continue;
      rows_.push_back({line, split(text)});
      last_line_ = line;
    }
    if (rows_.empty()) fail(0, "the file of phases is empty", "begin with the line `task,first_release_ms`");
    header_ = rows_.front();
    rows_.erase(rows_.begin());
    for (const Row& row : rows_) {
      if (row.fields.size() == header_.fields.size()) continue;
      fail(row.line, "the row has " + std::to_string(row.fields.size()) + " fields",
           "give " + std::to_string(header_.fields.size()) + ", one for each column of the header");
    }
  }

  /// `# TASK period_ns N wcet_ns N first_release_ns N`, a line for each timer.
  void read_trace_header() {
    rows_.insert(rows_.begin(), header_);
    for (const Row& row : rows_) {
      std::istringstream words(row.fields.front().substr(kTraceHeader.size()));
      std::string task, key;
      std::int64_t period = 0, wcet = 0, first = 0;
      if (!(words >> task >> key >> period >> key >> wcet >> key >> first) || key != "first_release_ns") {
        fail(row.line, "this is no header line of a golden trace",
             "give `# TASK period_ns N wcet_ns N first_release_ns N`");
      }
      set(row.line, task, format_ms(Duration(first)), false);
    }
  }

  void read_tasks(bool created) {
    for (const Row& row : rows_) set(row.line, row.fields[0], row.fields[1], created);
  }

  void read_executor(const std::string& executor) {
    const auto& columns = header_.fields;
    const auto executor_column =
        static_cast<std::size_t>(std::find(columns.begin(), columns.end(), "executor") - columns.begin());
    const Row* chosen = nullptr;
    std::vector<std::string> executors;
    for (const Row& row : rows_) {
      const std::string& name = row.fields[executor_column];
      executors.push_back(name.substr(0, name.find(" (")));
      if (name == executor || (!chosen && executors.back() == executor)) chosen = &row;
    }
    if (!chosen) fail(header_.line, "no row for executor " + executor, suggest(executor, executors));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (!columns[c].starts_with(kWidePrefix)) continue;
      set(chosen->line, columns[c].substr(kWidePrefix.size()), chosen->fields[c], true);
    }
    last_line_ = header_.line;  // where a missing column belongs
  }

  void set(int line, const std::string& name, const std::string& number, bool created) {
    TaskId id = 0;
    while (id < tasks_.set.size() && (tasks_.set[id].name != name || tasks_.set[id].kind != TaskKind::timer))
      ++id;
    if (id == tasks_.set.size()) fail(line, "the graph has no timer " + name, suggest(name, timers_));
    if (known_[id] != 0) {
      fail(line, "a second phase for timer " + name,
           "keep one (the other is in line " + std::to_string(known_[id]) + ")");
    }
    const std::optional<Duration> instant = parse_ms(number);
    if (!instant || *instant < Duration::zero()) {
      fail(line, "the phase of timer " + name + " is `" + number + "`",
           "give decimal milliseconds such as 4.2, not negative");
    }
    first_[id] = *instant + (created ? tasks_.set[id].period : Duration::zero());
    known_[id] = line;
  }

  std::string path_;
  GraphTasks tasks_;
  std::vector<std::string> timers_;
  Row header_;
  std::vector<Row> rows_;
  int last_line_ = 0;
  std::vector<Duration> first_;
  std::vector<int> known_;  ///< Line that gave the phase of each task; 0: none yet.
};

}  // namespace

std::vector<Duration> read_phases(const std::string& path, const Graph& graph, const std::string& executor) {
  return PhasesFile(path, graph).read(executor);
}

}  // namespace hotpath
