// SPDX-License-Identifier: Apache-2.0
// Compares hotpath with the independent simulator on random graphs: every job and latency of
// `hotpath simulate`, and the bounds of `hotpath analyze`. Plants errors in the simulator and expects
// the comparison to find each.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <set>

#include "generator.hpp"
#include "hotpath_program.hpp"

namespace independent {

namespace {

/// End of a simulation, no multiple of the grids on which events of most graphs lie.
constexpr Nanoseconds kUntil = 650'050'001;
const std::string kDuration = "0.650050001";
constexpr std::size_t kMostShown = 20;

/// A schedule in comparable form: jobs that ran in their order; sorted losses and latencies.
using Row = std::array<std::int64_t, 10>;
using Rows = std::array<std::vector<Row>, 2>;

struct Counts {
  std::size_t graphs = 0, schedules = 0, jobs = 0, losses = 0, outputs = 0, duplicates = 0;
  std::size_t bounds = 0, exact = 0, not_explored = 0, differences = 0;
  std::size_t of_threads = 0;  ///< Of the bounds.
};

class Check {
 public:
  Check(std::string hotpath, std::string folder) : hotpath_(std::move(hotpath)), folder_(std::move(folder)) {}

  /// Returns the exit code.
  int report() const {
    const Counts& c = counts_;
    std::cout << c.graphs << " graphs, " << c.schedules << " schedules, " << c.jobs << " jobs, " << c.losses
              << " losses and empty events, " << c.outputs << " latencies (" << c.duplicates
              << " with duplicates), " << c.bounds << " bounds (" << c.of_threads << " of deployments), "
              << c.exact << " exact values (" << c.not_explored << " graphs not explored): " << c.differences
              << " differences\n";
    for (std::size_t f = 1; f < found_.size(); ++f)
      if (!found_[f]) std::cout << "planted error " << f << " was not found\n";
    const bool all = std::ranges::all_of(found_.begin() + 1, found_.end(), std::identity());
    return c.differences == 0 && all && c.exact > c.graphs && c.of_threads > c.graphs ? 0 : 1;
  }

  void check(std::uint64_t seed) {
    file_ = folder_ + "/" + std::to_string(seed) + ".yaml";
    write_random_graph(seed, file_);
    graph_ = read_graph(file_);
    const Nanoseconds dispatch = seed % 3 == 0 ? 37'000 : 0,
                      of_timers = seed % 2 == 0 ? dispatch : 2 * dispatch;
    delivery_ =
        seed % 2 == 0 ? 0 : std::array<Nanoseconds, 4>{1'000, 50'000, 1'000'000, 8'000'000}[seed / 2 % 4];
    options_ =
        " --phases given --platform timer_thread=raised,dispatch_cost_us=" + std::to_string(dispatch / 1000) +
        ",timer_dispatch_cost_us=" + std::to_string(of_timers / 1000) +
        ",delivery_delay_us=" + std::to_string(delivery_ / 1000);
    const std::string run = folder_ + "/run";
    std::filesystem::remove_all(run);
    if (!run_command(hotpath_ + " simulate --graph " + file_ + options_ +
                         " --execution-times uniform --seed " + std::to_string(seed) +
                         " --warm-up 0 --duration " + kDuration + " --threads 1 --executors " +
                         joined(kExecutors) + " --output " + run,
                     folder_ + "/simulate.txt")) {
      differ("hotpath rejects the graph, see simulate.txt");
      return;
    }
    const StoredRun stored = read_run(graph_, run);
    times_.assign(graph_.tasks.size(), {});
    learn_times(stored);
    const std::vector<Bound> bounds = analyzed(seed);
    ++counts_.graphs;
    Conditions conditions{{}, kUntil, of_timers, dispatch};
    for (const Task& task : graph_.tasks) conditions.phases.push_back(task.phase);
    if (delivery_ > 0) conditions.delay = [this] { return delivery_; };
    const auto rows_of = [this](const Result& result) { return comparable(result); };
    for (const std::string& label : kExecutors) {
      const Deployment alone{{Thread{Executor(label)}}, std::vector<std::size_t>(graph_.tasks.size(), 0)};
      count(compare(label, stored.at(label), bounds, alone, conditions, rows_of));
    }
    if (seed % 3 == 1) compare_deployment(seed, conditions);
  }

 private:
  /// Returns the schedule that `stored` should be. `rows_of`: what of a schedule is comparable.
  Result compare(const std::string& label, const Result& stored, const std::vector<Bound>& bounds,
                 Deployment deployment, const Conditions& conditions, const auto& rows_of) {
    Result result = simulate(graph_, deployment, conditions, draw_);
    note_duplicates(result);
    const Rows rows = rows_of(result), expected = rows_of(stored);
    // At one instant, no document says which of two processors goes first.
    std::set<Nanoseconds> ends;
    const bool clear =
        deployment.threads.size() == 1 || std::ranges::all_of(result.jobs, [&](const Job& job) {
          return job.outcome != Outcome::ran || ends.insert(job.finish).second;
        });
    for (const std::size_t part : {0, 1}) {
      const auto [mine, theirs] = std::ranges::mismatch(rows[part], expected[part]);
      if (!clear || (mine == rows[part].end() && theirs == expected[part].end())) continue;
      differ(label + ": " + shown(mine, rows[part].end()) +
             "\n    hotpath: " + shown(theirs, expected[part].end()));
    }
    compare_bounds(label, bounds, result);
    compare_delays(label, bounds, deployment, conditions);
    // Which errors in the simulator make its schedule differ.
    for (std::size_t f = 1; f < found_.size() && rows == expected; ++f) {
      deployment.fault = static_cast<Fault>(f);
      found_[f] = found_[f] || rows_of(simulate(graph_, deployment, conditions, draw_)) != expected;
    }
    return result;
  }

  /// Nodes on threads of one or two processors, as a file for hotpath.
  Deployment draw_deployment(std::uint64_t seed, const std::string& file) {
    std::mt19937_64 random(seed);
    const std::vector<std::string> executors = {"default", "static", "events-ro", "rm-ro", "fp-ro", "edf-ro"};
    Deployment deployment;
    std::map<std::string, std::size_t> thread_of;  // by node
    std::vector<std::string> owns;
    const std::size_t most = 2 + random() % 4;
    for (const Task& task : graph_.tasks) {
      const bool opens = owns.size() < most && (owns.empty() || random() % 2 == 0);
      const auto [node, is_new] =
          thread_of.try_emplace(task.node, opens ? owns.size() : random() % owns.size());
      if (is_new && node->second == owns.size()) {
        owns.emplace_back();
        deployment.threads.push_back({Executor(executors[random() % executors.size()]),
                                      static_cast<int>(10 * (1 + random() % 4)), random() % 2});
      }
      if (is_new) owns[node->second] += (owns[node->second].empty() ? "" : ", ") + task.node;
      deployment.thread_of.push_back(node->second);
    }
    std::ofstream out(file);
    out << "name: threads\nexecutors:\n";
    for (std::size_t t = 0; t < owns.size(); ++t) {
      const Thread& thread = deployment.threads[t];
      out << "  - {name: t" << t << ", executor: \"" << thread.executor.label
          << "\", policy: \"fifo:" << thread.priority << "\", processors: [" << thread.processor
          << "], owns: [" << owns[t] << "]}\n";
    }
    return deployment;
  }

  /// The jobs of threads under SCHED_FIFO, their latencies, and the bounds of `analyze --deployments`.
  void compare_deployment(std::uint64_t seed, const Conditions& conditions) {
    const std::string plan = folder_ + "/" + std::to_string(seed) + ".threads.yaml",
                      run = folder_ + "/threads", csv = folder_ + "/bounds.csv",
                      threads = " --cores 2 --deployments " + plan;
    const Deployment deployment = draw_deployment(seed, plan);
    std::filesystem::remove_all(run);
    std::filesystem::remove(csv);
    const bool simulated = run_command(
        hotpath_ + " simulate --graph " + file_ + options_ + " --execution-times uniform --seed " +
            std::to_string(seed) + " --warm-up 0 --duration " + kDuration + threads + " --output " + run,
        folder_ + "/simulate.txt");
    run_command(hotpath_ + " analyze " + file_ + options_ + threads + " --csv " + csv,
                folder_ + "/analyze.txt");
    if (!simulated) return differ("hotpath rejects the deployment, see simulate.txt");
    const StoredRun stored = read_run(graph_, run);
    if (!learn_times(stored)) return;
    const std::vector<Bound> bounds = read_bounds(csv);
    counts_.of_threads += bounds.size();
    compare("threads", stored.at("threads"), bounds, deployment, conditions,
            [this](const Result& result) { return of_threads(result); });
  }

  /// Comparable without the instants of releases, which more urgent threads delay, and without the order of
  /// starts, which is none on two processors.
  Rows of_threads(const Result& result) const {
    Rows rows = comparable(result);
    for (Row& row : rows[0]) row[4] = 0;
    std::ranges::sort(rows[0]);
    return rows;
  }

  /// The execution times that hotpath drew: the same under every executor. Returns whether all that are new
  /// are sure: a job within which another one starts may have been preempted.
  bool learn_times(const StoredRun& stored) {
    bool sure = true;
    for (const auto& [label, result] : stored) {
      for (const Job& job : result.jobs) {
        auto& times = times_[static_cast<std::size_t>(job.task)];
        if (job.outcome != Outcome::ran) continue;
        const auto index = static_cast<std::size_t>(job.sequence);
        if (times.size() <= index) times.resize(index + 1, -1);  // unknown
        if (times[index] > 0) continue;
        times[index] = std::max(times[index], job.finish - job.start);  // 0: it did not work
        sure = sure && std::ranges::none_of(result.jobs, [&](const Job& other) {
                 return other.start > job.start && other.start < job.finish;
               });
      }
    }
    for (const auto& [label, result] : stored) {  // what works here may not have worked elsewhere
      for (const Job& job : result.jobs) {
        auto& times = times_[static_cast<std::size_t>(job.task)];
        const auto index = static_cast<std::size_t>(job.sequence);
        if (job.outcome == Outcome::running && index < times.size() && times[index] == 0) times[index] = -1;
      }
    }
    return sure;
  }

  Nanoseconds time(int task, std::int64_t sequence) const {
    const Task& t = graph_.tasks[static_cast<std::size_t>(task)];
    const auto& times = times_[static_cast<std::size_t>(task)];
    const auto index = static_cast<std::size_t>(sequence);
    // Unknown: no job of this sequence worked and ended, under any executor.
    return index < times.size() && times[index] >= t.best ? std::min(times[index], t.worst) : t.worst;
  }

  /// Bounds and exact values under a fifth of the executors, another one for each graph: `analyze` spends
  /// most of its time on explorations, so that more graphs show more.
  std::vector<Bound> analyzed(std::uint64_t seed) {
    std::vector<std::string> labels;
    for (std::size_t e = seed % 5; e < kExecutors.size(); e += 5) labels.push_back(kExecutors[e]);
    const std::string csv = folder_ + "/bounds.csv", command = hotpath_ + " analyze " + file_ + options_ +
                                                               " --csv " + csv + " --executors " +
                                                               joined(labels);
    std::filesystem::remove(csv);
    // In every seventh graph, explorations may have more states, but end after a second of the processor.
    run_command(seed % 7 == 0 ? "ulimit -t 1; " + command + " --exact" : command, folder_ + "/analyze.txt");
    std::vector<Bound> bounds = read_bounds(csv);
    counts_.not_explored += std::ranges::none_of(bounds, &Bound::exact) ? 1 : 0;
    return bounds;
  }

  /// Simulated <= exact <= every bound.
  void compare_bounds(const std::string& executor, const std::vector<Bound>& bounds, const Result& result) {
    const auto all = largest(graph_, result, true), without_duplicates = largest(graph_, result, false);
    std::map<Target, Nanoseconds> exact;
    for (const Bound& b : bounds) {
      if (b.executor != executor) continue;
      ++(b.exact ? counts_.exact : counts_.bounds);
      if (b.exact) exact[{b.kind, b.name}] = b.value;
      const auto& observed = b.exact ? without_duplicates : all;
      const auto value = observed.find({b.kind, b.name});
      if (value != observed.end() && value->second > b.value)
        differ(executor + ": " + b.kind + " " + b.name + ": " + std::to_string(value->second) +
               " ns exceeds " + std::to_string(b.value) + " by " + b.method);
    }
    for (const Bound& b : bounds) {
      const auto value = exact.find({b.kind, b.name});
      if (b.executor == executor && value != exact.end() && value->second > b.value)
        differ(executor + ": " + b.kind + " " + b.name + ": the exact value exceeds the bound by " +
               b.method);
    }
  }

  /// Bounds hold if each sample has a delay of its own; exact values need not.
  void compare_delays(const std::string& executor, std::vector<Bound> bounds, const Deployment& deployment,
                      Conditions conditions) {
    if (delivery_ == 0) return;
    std::erase_if(bounds, &Bound::exact);
    std::mt19937_64 random(counts_.graphs);
    conditions.any_order = true;
    conditions.delay = [&] {
      const auto longest = static_cast<std::uint64_t>(delivery_);
      return static_cast<Nanoseconds>(random() % 2 == 0 ? random() % (longest + 1) : random() % 2 * longest);
    };
    for (int run = 0; run < 3; ++run)
      compare_bounds(executor, bounds, simulate(graph_, deployment, conditions, draw_));
  }

  void note_duplicates(const Result& result) {
    duplicates_.clear();
    for (const Output& o : result.outputs) {
      if (o.duplicates) duplicates_.insert({o.chain, o.sequence});
    }
  }

  Rows comparable(const Result& result) const {
    Rows rows;
    for (const Job& j : result.jobs) {
      const auto outcome = static_cast<std::int64_t>(j.outcome);
      if (j.outcome == Outcome::ran || j.outcome == Outcome::running) {
        rows[0].push_back({outcome, j.task, j.sequence, j.timestamp, j.release, j.start, j.deadline, j.parent,
                           j.parent_sequence, j.outcome == Outcome::ran ? j.finish : 0});
      } else if (j.outcome == Outcome::empty) {
        rows[1].push_back({outcome, j.task, j.start});
      } else {
        rows[1].push_back({outcome, j.task, j.sequence, j.timestamp, j.parent, j.parent_sequence});
      }
    }
    for (const Output& o : result.outputs) {
      const bool known = !duplicates_.contains({o.chain, o.sequence});
      rows[1].push_back({100, o.chain, o.sequence, known ? o.hot_path : 0, known ? o.end_to_end : 0});
    }
    std::ranges::sort(rows[1]);
    return rows;
  }

  std::string shown(std::vector<Row>::const_iterator row, std::vector<Row>::const_iterator end) const {
    if (row == end) return "nothing";
    const bool latency = (*row)[0] == 100;
    const auto subject = static_cast<std::size_t>((*row)[1]);
    const std::vector<std::string> outcomes = {"ran", "running", "skipped", "overwritten", "empty"};
    std::string text = latency
                           ? "latency " + graph_.chains[subject].name
                           : outcomes[static_cast<std::size_t>((*row)[0])] + " " + graph_.tasks[subject].name;
    for (std::size_t i = 2; i < row->size(); ++i) text += " " + std::to_string((*row)[i]);
    return text;
  }

  void differ(const std::string& what) {
    if (counts_.differences++ < kMostShown) std::cout << file_ << ": " << what << "\n";
  }

  void count(const Result& result) {
    ++counts_.schedules;
    counts_.outputs += result.outputs.size();
    counts_.duplicates += duplicates_.size();
    for (const Job& job : result.jobs) ++(job.outcome == Outcome::ran ? counts_.jobs : counts_.losses);
  }

  std::string hotpath_, folder_, file_, options_;
  const Draw draw_ = [this](int task, std::int64_t sequence) { return time(task, sequence); };
  Nanoseconds delivery_ = 0;  ///< Longest delay of a sample.
  Graph graph_;
  std::vector<std::vector<Nanoseconds>> times_;        ///< Drawn execution times by task and sequence.
  std::set<std::pair<int, std::int64_t>> duplicates_;  ///< Outputs with several jobs of one source.
  Counts counts_;
  std::array<bool, static_cast<std::size_t>(Fault::count)> found_{};
};

}  // namespace

}  // namespace independent

int main(int count, char** arguments) { return independent::run_check<independent::Check>(count, arguments); }
