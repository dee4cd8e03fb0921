// SPDX-License-Identifier: Apache-2.0
// Prints for which share of random graphs with known phases the exploration finishes, and how long it takes:
// exact_share FIRST GRAPHS MOST_STATES [HYPERPERIOD_MS]. With a hyperperiod, timers have periods from 10 to
// 500 ms that divide it, instead of those of the mix, under the same load.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <numeric>

#include "bounds/exact_worst_cases.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/text.hpp"
#include "random_graphs.hpp"

namespace hotpath::test {
namespace {

constexpr std::size_t kMostTasks = 24;
constexpr double kMostSeconds = 10;

void draw_periods(Random& random, Graph& graph, std::int64_t hyperperiod_ms) {
  std::vector<std::int64_t> divisors;
  for (std::int64_t ms = 10; ms <= 500; ++ms) {
    if (hyperperiod_ms % ms == 0) divisors.push_back(ms);
  }
  const double load = load_percent(graph);
  for (Node& node : graph.nodes) {
    if (node.period == Duration{}) continue;
    const auto last = static_cast<std::int64_t>(divisors.size()) - 1;
    node.period = node.deadline =
        std::chrono::milliseconds(divisors[static_cast<std::size_t>(draw(random, 0, last))]);
  }
  scale_to_load(graph, load);
}

std::int64_t hyperperiod_ms(const TaskSet& set) {
  std::int64_t all = 1;
  for (const Task& task : set.tasks) {
    if (task.kind == TaskKind::timer) all = std::lcm(all, task.period.count() / 1'000'000);
  }
  return all;
}

struct Counts {
  std::size_t all = 0, exact = 0;
};

class Shares {
 public:
  void add(std::uint64_t seed, std::size_t most_states, std::int64_t hyperperiod) {
    Random random(seed);
    Graph graph = random_graph(random);
    if (hyperperiod > 0) draw_periods(random, graph, hyperperiod);
    GraphTasks tasks = make_tasks(graph);
    if (tasks.set.size() > kMostTasks) return;
    ++graphs_;
    PhaseOptions options;
    options.seed = seed;
    const std::vector<Duration> phases = make_phases(graph, tasks, Phases::random, options);
    for (TaskId id = 0; id < phases.size(); ++id) tasks.set.tasks[id].phase = phases[id];
    for (const char* name : {"default", "static", "events-ro", "cbg", "rm-ro", "dm-ro", "edf-ro", "fp-ro"}) {
      add(graph, tasks, *find_executor(name), seed, most_states);
    }
  }

  void print() const {
    std::printf("%zu graphs, %zu explorations; the longest took %.1f s of processor time\n", graphs_, cases_,
                longest_);
    for (const auto& [name, counts] : counts_) {
      std::printf("%-28s %5.1f %% of %zu\n", name.c_str(),
                  100 * static_cast<double>(counts.exact) / static_cast<double>(counts.all), counts.all);
    }
    for (const auto& [why, number] : why_not_) std::printf("%5zu x %s\n", number, why.c_str());
  }

 private:
  void add(const Graph& graph, const GraphTasks& tasks, const ExecutorEntry& executor, std::uint64_t seed,
           std::size_t most_states) {
    SchedulerOptions scheduling;
    scheduling.workers = 1;
    const std::clock_t start = std::clock();
    const GraphBounds bounds =
        bounds::exact_worst_cases(graph, tasks, executor, scheduling, {.max_states = most_states});
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    longest_ = std::max(longest_, seconds);
    ++cases_;
    std::string why = bounds.refusal.empty() ? bounds.left_out : bounds.refusal;
    if (why.empty() && seconds > kMostSeconds) why = "more than 10 s";
    const std::string sizes[] = {" 1 to  8 tasks", " 9 to 16 tasks", "17 to 24 tasks"};
    const std::string& size = sizes[(tasks.set.size() - 1) / 8];
    const std::string repeats = hyperperiod_ms(tasks.set) > 1200 ? "hyperperiod above 1.2 s" : "up to 1.2 s";
    for (const std::string& group : {std::string("all"), std::string(executor.name), size, repeats}) {
      ++counts_[group].all;
      counts_[group].exact += why.empty();
    }
    if (why.empty()) return;
    ++why_not_[why.substr(0, why.find(": more"))];
    std::printf("seed %llu, %u tasks, %s: %s after %.1f s\n", static_cast<unsigned long long>(seed),
                tasks.set.size(), std::string(executor.name).c_str(), why.c_str(), seconds);
  }

  std::size_t graphs_ = 0, cases_ = 0;
  double longest_ = 0;
  std::map<std::string, Counts> counts_;
  std::map<std::string, std::size_t> why_not_;
};

}  // namespace
}  // namespace hotpath::test

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() != 3 && arguments.size() != 4) {
    std::fputs("usage: exact_share FIRST GRAPHS MOST_STATES [HYPERPERIOD_MS]\n", stderr);
    return 2;
  }
  const std::uint64_t first = std::stoull(arguments[0]), graphs = std::stoull(arguments[1]);
  hotpath::test::Shares shares;
  const std::int64_t hyperperiod = arguments.size() == 4 ? std::stoll(arguments[3]) : 0;
  for (std::uint64_t seed = first; seed < first + graphs; ++seed) {
    shares.add(seed, std::stoull(arguments[2]), hyperperiod);
  }
  shares.print();
}
