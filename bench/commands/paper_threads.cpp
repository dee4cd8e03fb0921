// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "bounds/bounds.hpp"
#include "commands/command.hpp"
#include "guarantees/analyze.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::commands {

namespace {

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

std::string in_ms(std::int64_t ns) { return fixed(static_cast<double>(ns) / 1e6, 3); }

/// The published values of a case study beside exact values and bounds of hotpath.
class JudgedStudy {
 public:
  /// The number of its first schedule is `first`. `stores`: show() gets a folder.
  JudgedStudy(const CaseStudy& study, std::size_t first, bool stores) : study_(study), first_(first) {
    graph_.platform.cores = worker_count(*executor_.entry, executor_.scheduler);
    for (const std::vector<double>& ms : study.phases_ms) {
      std::ranges::transform(ms, schedules_.emplace_back(tasks_.set.size()).begin(), from_ms);
      const std::size_t s = schedules_.size() - 1;
      const GraphBounds bounds = exact(s, kBestCasePercent, stores ? &reached_[s] : nullptr);
      for (std::size_t c = 0; c < longest_.size(); ++c) {
        const std::int64_t age = bounds.chains[c]->latency;
        if (age > longest_[c].ns) longest_[c] = {age, s};
      }
    }
  }

  std::size_t schedules() const { return schedules_.size(); }

  void add_rows(Table& table) const {
    const auto guaranteed = setup::guarantees(graph_, tasks_, executor_).value_or(bounds::Guarantees());
    for (const Published& p : study_.published) {
      std::optional<GraphBounds> synchronous;
      if (!p.any_phases) synchronous = exact(0, p.best_case_percent);
      for (std::size_t c = 0; c < longest_.size(); ++c) {
        const Longest reached = synchronous ? Longest{synchronous->chains[c]->latency, 0} : longest_[c];
        const auto bound = guaranteed.of(Latency::age, graph_.chains[c].name);
        std::optional<std::int64_t> most;
        if (synchronous || bound) most = synchronous ? reached.ns : bound->ns;
        const std::int64_t published = std::llround(p.ms[c] * 1e6);
        // A longer schedule refutes a value; an upper bound that it does not undercut confirms it.
        const char* const verdict = reached.ns > published       ? "refuted"
                                    : most && published >= *most ? "confirmed"
                                                                 : "open";
        table.add_row({study_.graph, study_.executor, p.source, p.best_case_percent,
                       p.any_phases ? "any" : "all 0", graph_.chains[c].name, in_ms(published),
                       in_ms(reached.ns), most ? in_ms(*most) : "-", verdict, first_ + reached.schedule});
      }
    }
  }

  /// The commands that repeat the schedules. Stores those that reach a longest age below a folder, if given.
  void show(const std::filesystem::path& folder) {
    for (std::size_t s = 0; s < schedules_.size(); ++s) {
      GraphTasks tasks = tasks_;
      setup::set_phases(tasks.set, schedules_[s]);
      std::vector<std::string> phases;
      for (const TaskId id : tasks.set.timers())
        phases.push_back(concat(tasks.set[id].name, ".phase_ms=", to_ms(schedules_[s][id])));
      const std::string name = concat("schedule", first_ + s);
      std::cout << first_ + s << ": hotpath analyze " << study_.graph << " --executors " << study_.executor
                << " --cores " << graph_.platform.cores << " --phases given --set " << joined(phases, ",")
                << " --witness " << name << "\n";
      if (folder.empty()) continue;
      std::erase_if(reached_[s], [&](const bounds::ReachedWorstCase& worst) {
        return worst.latency != Latency::age || (s != 0 && longest_[worst.number].schedule != s);
      });
      std::cout << guarantees::write_witnesses(reached_[s], graph_, tasks, executor_, {}, folder / name);
    }
  }

 private:
  /// The longest age, and the first schedule that reaches it.
  struct Longest {
    std::int64_t ns = -1;
    std::size_t schedule = 0;
  };

  /// The worst cases under a schedule, for execution times from a share of the longest ones.
  GraphBounds exact(std::size_t schedule, int best_case_percent,
                    std::vector<bounds::ReachedWorstCase>* reached = nullptr) const {
    GraphTasks tasks = tasks_;
    setup::set_phases(tasks.set, schedules_[schedule]);
    for (Task& task : tasks.set.tasks) task.bcet = task.wcet * best_case_percent / 100;
    GraphBounds exact =
        bounds::exact_worst_cases(graph_, tasks, *executor_.entry, executor_.scheduler, {}, reached);
    if (exact.refusal) throw AnalysisError(*exact.refusal);
    return exact;
  }

  const CaseStudy& study_;
  const std::size_t first_;
  const setup::ExecutorSpec executor_ = setup::parse_executor(study_.executor, {});
  Graph graph_ = load_graph(find_graph(study_.graph));
  const GraphTasks tasks_ = make_tasks(graph_);
  std::vector<std::vector<Duration>> schedules_;                               // first timestamps, by task
  std::map<std::size_t, std::vector<bounds::ReachedWorstCase>> reached_;       // by schedule
  std::vector<Longest> longest_ = std::vector<Longest>(graph_.chains.size());  // by chain
};

void judge_published_threads(const std::string& output) {
  if (!output.empty()) program::check_output_folder(output);
  program::catch_interrupts();
  Table table("Published bounds on the age of chains on several threads, in ms",
              {"graph", "executor", "source", "least % of C", "phases", "chain", "published", "reached",
               "at most", "verdict", "schedule"});
  std::vector<JudgedStudy> studies;
  std::size_t schedules = 0;
  for (const CaseStudy& study : kCaseStudies) {
    studies.emplace_back(study, schedules, !output.empty()).add_rows(table);
    schedules += studies.back().schedules();
  }
  std::cout << table << "\nThe schedules, as runs that `hotpath report` and `hotpath explain` read:\n";
  for (JudgedStudy& judged : studies) judged.show(output);
  program::show_json(json_of(table));
  if (!output.empty())
    program::write_whole_file(std::filesystem::path(output) / "threads.csv", csv_of(table));
}

}  // namespace

void add_paper_threads(CLI::App& paper) {
  auto [threads, output] = add_command<std::string>(
      paper, "threads", "Published bounds for several threads against exact worst cases",
      "hotpath paper threads", judge_published_threads);
  add(threads, "--output", output, "FOLDER", "New folder for the table (CSV) and the longest schedules");
  add_json_option(threads);
}

}  // namespace hotpath::commands
