// SPDX-License-Identifier: Apache-2.0
#include "hotpath_program.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace independent {

namespace {

/// A CSV file without quoted commas, read row by row.
class Table {
 public:
  explicit Table(const std::string& file) : in_(file) {
    std::string line;
    std::getline(in_, line);
    split(line, header_);
  }

  bool next() {
    std::string line;
    if (!std::getline(in_, line)) return false;
    split(line, cells_);
    cells_.resize(std::max(cells_.size(), header_.size()));
    return true;
  }

  const std::string& operator[](const std::string& column) const {
    const auto at = std::ranges::find(header_, column);
    if (at == header_.end()) throw std::runtime_error("no column " + column);
    return cells_[static_cast<std::size_t>(at - header_.begin())];
  }

  std::int64_t number(const std::string& column) const {
    const std::string& cell = (*this)[column];
    return cell.empty() ? 0 : std::stoll(cell);
  }

 private:
  static void split(const std::string& line, std::vector<std::string>& cells) {
    cells.assign(1, "");
    for (const char c : line) c == ',' ? void(cells.emplace_back()) : cells.back().push_back(c);
  }

  std::ifstream in_;
  std::vector<std::string> header_, cells_;
};

}  // namespace

std::string joined(const std::vector<std::string>& items) {
  std::string out;
  for (const std::string& item : items) out += (out.empty() ? "" : ",") + item;
  return out;
}

bool run_command(const std::string& line, const std::string& output) {
  return std::system(("exec 2> /dev/null; export HOTPATH_FIGURES=none; (" + line + ") > " + output + " 2>&1")
                         .c_str()) == 0;
}

StoredRun read_run(const Graph& graph, const std::string& folder) {
  std::map<std::string, int> tasks = {{"", -1}}, chains;
  for (std::size_t t = 0; t < graph.tasks.size(); ++t) tasks[graph.tasks[t].name] = static_cast<int>(t);
  for (std::size_t c = 0; c < graph.chains.size(); ++c) chains[graph.chains[c].name] = static_cast<int>(c);
  const std::map<std::string, Outcome> outcomes = {{"ran", Outcome::ran},
                                                   {"running", Outcome::running},
                                                   {"skipped", Outcome::skipped},
                                                   {"overwritten", Outcome::overwritten},
                                                   {"empty", Outcome::empty}};
  StoredRun run;
  for (Table row(folder + "/jobs.csv"); row.next();) {
    const auto outcome = outcomes.find(row["outcome"]);
    if (outcome == outcomes.end()) continue;  // queued
    run[row["executor"]].jobs.push_back(
        {tasks.at(row["task"]), row.number("sequence"), outcome->second, row.number("timestamp_ns"),
         row.number("release_ns"), row.number("start_ns"), row.number("finish_ns"), row.number("deadline_ns"),
         tasks.at(row["parent_task"]), row.number("parent_sequence")});
  }
  for (Table row(folder + "/chains.csv"); row.next();)
    run[row["executor"]].outputs.push_back({chains.at(row["chain"]), row.number("sequence"),
                                            row.number("hot_path_latency_ns"),
                                            row.number("end_to_end_latency_ns")});
  return run;
}

std::vector<Bound> read_bounds(const std::string& file) {
  std::vector<Bound> bounds;
  for (Table row(file); row.next();) {
    if (row["bound_ns"].empty()) continue;
    const bool exact = row["method"].find("exact for these phases") != std::string::npos;
    bounds.push_back(
        {row["executor"], row["method"], row["kind"], row["name"], row.number("bound_ns"), exact});
  }
  return bounds;
}

std::map<Target, Nanoseconds> largest(const Graph& graph, const Result& result, bool duplicates) {
  std::map<Target, Nanoseconds> values;
  const auto keep = [&](const std::string& kind, const std::string& name, Nanoseconds value) {
    const auto [entry, is_new] = values.try_emplace({kind, name}, value);
    entry->second = std::max(entry->second, value);
  };
  std::vector<Nanoseconds> responses(graph.tasks.size(), -1);
  for (const Job& job : result.jobs) {
    Nanoseconds& response = responses[static_cast<std::size_t>(job.task)];
    if (job.outcome == Outcome::ran) response = std::max(response, job.finish - job.timestamp);
  }
  for (std::size_t t = 0; t < responses.size(); ++t) {
    if (responses[t] >= 0) keep("task", graph.tasks[t].name, responses[t]);
  }
  for (const Output& output : result.outputs) {
    if (output.duplicates && !duplicates) continue;
    const std::string& name = graph.chains[static_cast<std::size_t>(output.chain)].name;
    keep("hot_path", name, output.hot_path);
    keep("chain", name, output.end_to_end);
  }
  return values;
}

}  // namespace independent
