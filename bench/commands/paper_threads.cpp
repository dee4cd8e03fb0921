// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "bounds/exact_worst_cases.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "guarantees/witnesses.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/table.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::commands {

namespace {

using Schedule = std::vector<Duration>;  ///< The first timestamps, by task.

/// Values in ms that are published as upper bounds on the latencies of the chains of a case study.
struct Published {
  const char* source;
  int best_case_percent;  ///< Least execution times, of the longest ones.
  bool any_phases;        ///< False: all timers begin at one instant.
  std::vector<double> ms;
};

struct CaseStudy {
  const char *graph, *executor;
  /// By timer, which come first in these graphs: of the graph, and some under which a chain lasts long.
  std::vector<std::vector<double>> phases_ms;
  std::vector<Published> published;
};

/// From the artifact of Radulescu et al. (ECRTS 2025, github.com/RaduLucianR/sag-ros-experiments, 3fcc836),
/// which also computes the bounds of Jiang et al. (RTSS 2022) and of Sobhani et al. (RTAS 2023).
const std::vector<CaseStudy> kCaseStudies = {
    {"three_chains",
     "multi:2",
     {{0, 0, 0}, {2, 0, 0.7}, {20, 0, 19}, {0, 0, 7.3}},
     {{"Radulescu 2025, Ours-1", 100, false, {42, 52.3, 54.7}},
      {"Radulescu 2025, Ours-1", 50, false, {65.099, 73.1, 72.3}},
      {"Radulescu 2025, no overhead", 50, false, {45.449, 56.099, 62.299}},
      {"Radulescu 2025, varied best case", 25, false, {41.199, 57.224, 62.299}},
      {"Jiang 2022", 50, true, {54.1, 76.1, 103.98}},
      {"Jiang 2022, with the last chain's part", 50, true, {103.3, 103.3, 103.3}},
      {"Sobhani 2023", 50, true, {103.9, 103.6, 103.9}}}},
    {"four_chains",
     "multi:2",
     {{0, 0, 0}, {0, 41.407, 6.25}, {0, 1.351, 0.74}},
     {{"Radulescu 2025, Ours-1", 100, false, {15.101, 41.105, 49.258, 137.17}},
      {"Radulescu 2025, Ours-1", 50, false, {106.49, 179.413, 131.393, 215.572}},
      {"Jiang 2022", 50, true, {53.119, 55.928, 112.088, 222.069}},
      {"Sobhani 2023", 50, true, {204.48, 128.76, 155.1, 245.2}}}},
    {"four_chains",
     "multi:4",
     {{0, 0, 0}},
     {{"Radulescu 2025, Ours-1", 100, false, {6.242, 17.914, 35.279, 126.159}},
      {"Radulescu 2025, Ours-1", 50, false, {6.242, 26.99, 36.168, 130.928}},
      {"Jiang 2022", 50, true, {19.54, 29.854, 47.17, 171.49}},
      {"Sobhani 2023", 50, true, {61.28, 70.2, 80.61, 171.49}}}}};
constexpr int kBestCasePercent = 50;  ///< Of the graphs, and of all schedules for any phases.

struct ThreadsArguments {
  std::string output;
};

struct ReachedAge {
  std::int64_t ns = -1;
  std::size_t schedule = 0;
};

std::string in_ms(std::int64_t ns) { return program::fixed(static_cast<double>(ns) / 1e6, 3); }

/// The published values of a case study beside exact values and bounds of hotpath.
class JudgedStudy {
 public:
  JudgedStudy(const CaseStudy& study, std::size_t first_schedule) : study_(study), number_(first_schedule) {
    graph_.platform.cores = worker_count(*executor_.entry, executor_.scheduler);
    for (const std::vector<double>& ms : study.phases_ms) {
      schedules_.emplace_back(tasks_.set.size());
      std::ranges::transform(ms, schedules_.back().begin(), [](double phase) { return from_ms(phase); });
    }
  }

  /// Adds the rows of its values, and returns the number of its schedules.
  std::size_t judge(program::Table& table) {
    for (std::size_t s = 0; s < schedules_.size(); ++s) {
      const GraphBounds bounds = exact(schedules_[s], kBestCasePercent);
      for (std::size_t c = 0; c < longest_.size(); ++c) {
        if (age(bounds, c) > longest_[c].ns) longest_[c] = {age(bounds, c), s};
      }
    }
    const auto guaranteed = setup::guarantees(graph_, tasks_, executor_);
    for (const Published& p : study_.published) {
      std::optional<GraphBounds> synchronous;
      if (!p.any_phases) synchronous = exact(schedules_.front(), p.best_case_percent);
      for (std::size_t c = 0; c < longest_.size(); ++c) {
        const ReachedAge reached = synchronous ? ReachedAge{age(*synchronous, c), 0} : longest_[c];
        std::int64_t most = synchronous ? reached.ns : kNoBound;
        if (!synchronous && guaranteed && guaranteed->chains[c].age) most = guaranteed->chains[c].age->ns;
        const std::int64_t published = std::llround(p.ms[c] * 1e6);
        // A longer schedule refutes a value; an upper bound that it does not undercut confirms it.
        const char* const verdict = reached.ns > published ? "refuted"
                                    : published >= most    ? "confirmed"
                                                           : "open";
        table.add_row({study_.graph, study_.executor, p.source, p.best_case_percent,
                       p.any_phases ? "any" : "all 0", graph_.chains[c].name, in_ms(published),
                       in_ms(reached.ns), most == kNoBound ? "-" : in_ms(most), verdict,
                       static_cast<std::int64_t>(number_ + reached.schedule)});
      }
    }
    return schedules_.size();
  }

  /// The commands that repeat the schedules. Stores those that reach a longest age below a folder, if given.
  void show(const std::filesystem::path& folder) const {
    for (std::size_t s = 0; s < schedules_.size(); ++s) {
      std::vector<std::string> phases;
      for (TaskId id = 0; tasks_.set[id].kind == TaskKind::timer; ++id)
        phases.push_back(program::concat(tasks_.set[id].name, ".phase_ms=", to_ms(schedules_[s][id])));
      const std::string name = program::concat("schedule", number_ + s);
      std::cout << number_ + s << ": hotpath analyze " << study_.graph << " --executors " << study_.executor
                << " --cores " << graph_.platform.cores << " --phases given --set "
                << program::joined(phases, ",") << " --witness " << name << "\n";
      if (folder.empty()) continue;
      std::vector<bounds::ReachedWorstCase> reached;
      (void)exact(schedules_[s], kBestCasePercent, &reached);
      std::erase_if(reached, [&](const bounds::ReachedWorstCase& worst) {
        return worst.latency != Latency::age || (s != 0 && longest_[worst.number].schedule != s);
      });
      GraphTasks tasks = tasks_;
      setup::set_phases(tasks.set, schedules_[s]);
      std::cout << guarantees::write_witnesses(reached, graph_, tasks, executor_, {}, folder / name);
    }
  }

 private:
  static constexpr std::int64_t kNoBound = std::numeric_limits<std::int64_t>::max();

  /// The worst cases for these phases and execution times from a share of the longest ones.
  GraphBounds exact(const Schedule& first, int best_case_percent,
                    std::vector<bounds::ReachedWorstCase>* reached = nullptr) const {
    const auto known = known_.find({first, best_case_percent});
    if (known != known_.end() && reached == nullptr) return known->second;
    GraphTasks tasks = tasks_;
    setup::set_phases(tasks.set, first);
    for (Task& task : tasks.set.tasks) task.bcet = task.wcet * best_case_percent / 100;
    GraphBounds bounds =
        bounds::exact_worst_cases(graph_, tasks, *executor_.entry, executor_.scheduler, {}, reached);
    known_.insert_or_assign({first, best_case_percent}, bounds);
    return bounds;
  }

  static std::int64_t age(const GraphBounds& bounds, std::size_t chain) {
    if (bounds.refusal) throw AnalysisError(*bounds.refusal);
    return bounds.chains[chain]->latency;
  }

  const CaseStudy& study_;
  const std::size_t number_;  // of its first schedule
  const setup::ExecutorSpec executor_ = setup::parse_executor(study_.executor, {});
  Graph graph_ = load_graph(find_graph(study_.graph));
  const GraphTasks tasks_ = make_tasks(graph_);
  std::vector<Schedule> schedules_;
  mutable std::map<std::pair<Schedule, int>, GraphBounds> known_;                    // results of exact()
  std::vector<ReachedAge> longest_ = std::vector<ReachedAge>(graph_.chains.size());  // by chain
};

void judge_published_threads(const ThreadsArguments& arguments) {
  if (!arguments.output.empty()) program::check_output_folder(arguments.output);
  program::catch_interrupts();
  program::Table table("Published bounds on the age of chains on several threads, in ms",
                       {"graph", "executor", "source", "least % of C", "phases", "chain", "published",
                        "reached", "at most", "verdict", "schedule"});
  std::vector<JudgedStudy> studies;
  std::size_t schedules = 0;
  for (const CaseStudy& study : kCaseStudies) {
    JudgedStudy& judged = studies.emplace_back(study, schedules);
    schedules += judged.judge(table);
  }
  std::cout << table << "\nThe schedules, as runs that `hotpath report` and `hotpath explain` read:\n";
  for (const JudgedStudy& judged : studies) judged.show(arguments.output);
  program::show_json(json_of(table));
  if (!arguments.output.empty())
    program::write_whole_file(std::filesystem::path(arguments.output) / "threads.csv", csv_of(table));
}

}  // namespace

void add_paper_threads(CLI::App& paper) {
  auto [threads, judged] = add_command<ThreadsArguments>(
      paper, "threads", "Published bounds for several threads against exact worst cases",
      "hotpath paper threads", judge_published_threads);
  add(threads, "--output", judged.output, "FOLDER",
      "New folder for the table (CSV) and the longest schedules");
  add_json_option(threads);
}

}  // namespace hotpath::commands
