// SPDX-License-Identifier: Apache-2.0
// Searches schedules that come close to the bounds of `hotpath analyze` for any phases: hill climbing
// over phases and execution times with the independent simulator. Prints found / bound per executor
// and method, and every bound that is exceeded.
#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <random>

#include "generator.hpp"
#include "hotpath_program.hpp"

namespace independent {

namespace {

/// Execution times of a task repeat after so many jobs.
constexpr std::size_t kTimes = 16;
/// Steps after which a climb starts anew.
constexpr int kClimb = 500;
/// Prints intermediate figures after so many graphs.
constexpr std::uint64_t kReported = 100;

/// A point of the search.
struct Point {
  std::vector<Nanoseconds> phases;              ///< By task.
  std::vector<std::vector<Nanoseconds>> times;  ///< By task and job.
};

class Climb {
 public:
  Climb(const Graph& graph, const Executor& executor, std::uint64_t seed)
      : graph_(graph), executor_(executor), random_(seed) {
    for (std::size_t t = 0; t < graph.tasks.size(); ++t) {
      if (graph.tasks[t].timer) timers_.push_back(t);
      longest_ = std::max(longest_, graph.tasks[t].period);
    }
  }

  /// The largest value of each target over all schedules visited.
  const std::map<Target, Nanoseconds>& best() const { return best_; }
  const Point& reached_by(const Target& target) const { return points_.at(target); }

  void maximise(const Target& target, int steps) {
    Point point = start();
    Nanoseconds value = evaluate(point, target);
    for (int i = 0; i < steps; ++i) {
      if (i == steps / 2 && best_.contains(target) && best_.at(target) > value) {
        point = points_.at(target);
        value = best_.at(target);
      }
      Point next = point;
      for (std::size_t changes = 1 + below(3); changes > 0; --changes) change(next);
      const Nanoseconds reached = evaluate(next, target);
      if (reached < value) continue;
      value = reached;
      point = std::move(next);
    }
  }

 private:
  std::size_t below(std::size_t n) { return random_() % n; }

  Nanoseconds between(Nanoseconds least, Nanoseconds most) {
    return least + static_cast<Nanoseconds>(below(static_cast<std::size_t>(most - least + 1)));
  }

  Point start() {
    Point point;
    for (const Task& t : graph_.tasks) {
      point.phases.push_back(t.timer ? between(0, t.period - 1) : 0);
      point.times.emplace_back(kTimes, t.worst);
    }
    return point;
  }

  void change(Point& point) {
    const std::size_t t = timers_[below(timers_.size())];
    const std::size_t kind = below(10);
    if (kind < 2) {
      point.phases[t] = between(0, graph_.tasks[t].period - 1);
    } else if (kind < 7 && !instants_.empty()) {  // just before, at or just after the start or end of a job
      const Nanoseconds at = instants_[below(instants_.size())] + between(-1, 1);
      point.phases[t] = (at % graph_.tasks[t].period + graph_.tasks[t].period) % graph_.tasks[t].period;
    } else {
      const std::size_t task = below(point.times.size());
      const Nanoseconds least = graph_.tasks[task].best, most = graph_.tasks[task].worst;
      const Nanoseconds time = below(3) == 0 ? between(least, most) : below(2) == 0 ? least : most;
      if (below(3) == 0) point.times[task].assign(kTimes, time);
      point.times[task][below(kTimes)] = time;
    }
  }

  Nanoseconds evaluate(const Point& point, const Target& target) {
    const Conditions conditions{point.phases, 4 * longest_ + 1, 0};
    const Result result = simulate(graph_, executor_, conditions, [&](int task, std::int64_t sequence) {
      return point.times[static_cast<std::size_t>(task)][static_cast<std::size_t>(sequence) % kTimes];
    });
    instants_.clear();
    for (const Job& job : result.jobs) {
      if (job.outcome == Outcome::ran) instants_.insert(instants_.end(), {job.start, job.finish});
    }
    const std::map<Target, Nanoseconds> values = largest(graph_, result, true);
    for (const auto& [name, value] : values) {
      const auto [entry, is_new] = best_.try_emplace(name, value);
      if (!is_new && value <= entry->second) continue;
      entry->second = value;
      points_[name] = point;
    }
    const auto value = values.find(target);
    return value == values.end() ? 0 : value->second;
  }

  const Graph& graph_;
  const Executor& executor_;
  std::mt19937_64 random_;
  std::vector<std::size_t> timers_;
  Nanoseconds longest_ = 0;              ///< Period.
  std::vector<Nanoseconds> instants_{};  ///< Starts and ends of jobs in the last schedule.
  std::map<Target, Nanoseconds> best_{};
  std::map<Target, Point> points_{};
};

/// found / bound of one executor and method.
struct Tightness {
  std::vector<double> timers, subscriptions, chains;
};

class Search {
 public:
  Search(std::string hotpath, std::string folder, int steps)
      : hotpath_(std::move(hotpath)), folder_(std::move(folder)), steps_(steps) {}

  std::size_t bounds = 0, violations = 0;

  void climb(const std::string& file, std::uint64_t seed, bool chains_only) {
    const Graph graph = read_graph(file);
    const std::string csv = folder_ + "/bounds.csv";
    std::filesystem::remove(csv);
    if (!run_command(hotpath_ + " analyze " + file + " --executors " + joined(kExecutors) + " --csv " + csv,
                     folder_ + "/analyze.txt"))
      return;
    const std::vector<Bound> all = read_bounds(csv);
    for (const std::string& label : kExecutors) {
      const Executor executor(label);
      Climb climb(graph, executor, seed);
      for (const Bound& b : all) {
        const bool wanted = b.executor == label && (!chains_only || b.kind != "task");
        if (!wanted || b.value == 0) continue;
        for (int left = steps_; left > 0; left -= kClimb)
          climb.maximise({b.kind, b.name}, std::min(left, kClimb));
      }
      for (const Bound& b : all) {
        if (b.executor == label && (!chains_only || b.kind != "task")) judge(graph, file, b, climb);
      }
    }
  }

  void print() const {
    std::cout << std::fixed << std::setprecision(2)
              << "executor, method: median of found / bound (number) of timers, subscriptions, chains\n";
    for (const auto& [key, tightness] : tightness_) {
      std::cout << key << ":";
      for (const std::vector<double>* values :
           {&tightness.timers, &tightness.subscriptions, &tightness.chains})
        std::cout << "  " << median(*values) << " (" << values->size() << ")";
      std::cout << "\n";
    }
    std::cout << bounds << " bounds, " << violations << " exceeded" << std::endl;
  }

 private:
  void judge(const Graph& graph, const std::string& file, const Bound& b, const Climb& climb) {
    const auto found = climb.best().find({b.kind, b.name});
    if (found == climb.best().end() || b.value == 0) return;
    ++bounds;
    const auto task = std::ranges::find(graph.tasks, b.name, &Task::name);
    Tightness& tightness = tightness_[b.executor + ", " + b.method];
    auto& values = b.kind != "task" ? tightness.chains
                   : task->timer    ? tightness.timers
                                    : tightness.subscriptions;
    values.push_back(static_cast<double>(found->second) / static_cast<double>(b.value));
    if (found->second <= b.value) return;
    ++violations;
    std::cout << file << ": " << b.executor << ", " << b.kind << " " << b.name << ": " << found->second
              << " ns exceeds " << b.value << " by " << b.method << "; phases in ns";
    for (const Nanoseconds phase : climb.reached_by(found->first).phases) std::cout << " " << phase;
    std::cout << "\n";
  }

  static double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
    return values[values.size() / 2];
  }

  std::string hotpath_, folder_;
  int steps_;
  std::map<std::string, Tightness> tightness_{};
};

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() != 4 && arguments.size() != 5) {
    std::cerr << "usage: independent_climb HOTPATH FOLDER STEPS FIRST_SEED GRAPHS\n"
                 "       independent_climb HOTPATH FOLDER STEPS GRAPH.yaml (chains only)\n";
    return 2;
  }
  std::filesystem::create_directories(arguments[1]);
  Search search(arguments[0], arguments[1], std::stoi(arguments[2]));
  if (arguments.size() == 4) {
    search.climb(arguments[3], 1, true);
  } else {
    const std::uint64_t first = std::stoull(arguments[3]), graphs = std::stoull(arguments[4]);
    for (std::uint64_t seed = first; seed < first + graphs; ++seed) {
      const std::string file = arguments[1] + "/" + std::to_string(seed) + ".yaml";
      write_random_graph(seed, file);
      search.climb(file, seed, false);
      if ((seed + 1 - first) % kReported == 0) search.print();
    }
  }
  search.print();
  return search.violations == 0 ? 0 : 1;
}

}  // namespace

}  // namespace independent

int main(int count, char** arguments) { return independent::run({arguments + 1, arguments + count}); }
