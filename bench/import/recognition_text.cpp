// SPDX-License-Identifier: Apache-2.0
#include "import/recognition.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "hotpath/core/job_order.hpp"
#include "hotpath/core/simulator.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::imports {

namespace {

std::string share_of(const Score& score, const Recognition& r) {
  return program::text("%.1f %% of %zu contested decisions", 100 * score.agreement, r.contested);
}

std::string next_one(const Recognition& r) {
  if (r.ranking.size() == 1) return "; no other known executor has such threads.";
  if (r.leading >= r.ranking.size()) return ".";
  const Score& next = r.ranking[r.leading];
  return program::text("; the next one, %s, explains %.1f %%.", next.hypothesis.label.c_str(),
                       100 * next.agreement);
}

std::string tie(const Recognition& r) {
  const std::vector<std::string> unlikely = r.names(true);
  std::vector<std::string> likely = r.names();
  std::erase_if(likely, [&](const std::string& name) { return std::ranges::count(unlikely, name) > 0; });
  std::string all = program::concat(
      program::joined(likely, ", "),
      likely.size() == 1 ? " explains the recording best, " : " explain the recording equally well, ",
      share_of(r.ranking.front(), r));
  if (!unlikely.empty())
    all += program::concat("; ", program::joined(unlikely, ", "), " cannot be excluded, but ",
                           unlikely.size() == 1 ? "makes" : "make",
                           " the recording a thousand times less likely");
  return all + next_one(r) + (r.remedy.empty() ? "" : " " + r.remedy);
}

std::string undecided(const Recognition& r, const std::string& names) {
  std::size_t differing = 0;
  for (const Score& score : std::span(r.ranking).first(r.leading))
    differing = std::max(differing, score.differing());
  const std::string known = r.contested == 0 ? "No" : program::concat("Only ", r.contested);
  const std::string remedy = r.remedy.empty() ? "" : " " + r.remedy;
  return differing == 0 || r.contested < 20
             ? program::concat(known, " of ", r.decisions,
                               " judged decisions had a choice, too few to tell executors apart (possible: ",
                               names, "). Record at a load at which callbacks wait for each other.", remedy)
             : program::concat("The recording does not tell ", names, " apart: they differ in at most ",
                               differing, " of ", r.contested, " contested decisions.", remedy);
}

/// Length of each simulation.
constexpr Duration kLength = std::chrono::seconds(4);
/// Loads from the first tenth above the recorded one up to the last, in percent.
constexpr int kStep_percent = 10, kLast_percent = 100;
/// Jobs in another place count as another order from this number on: fewer would not suffice to
/// tell executors apart.
constexpr double kDiffering = 20;

/// Simulations of a graph with longer execution times.
class LoadedGraph {
 public:
  LoadedGraph(const Graph& graph, const GraphTasks& tasks)
      : graph_(graph), tasks_(tasks), times_(simulated::execution_times_of(graph, tasks, 1)) {}

  /// The jobs that run, by start; std::nullopt: the executor is overloaded.
  [[nodiscard]] std::optional<std::vector<Job>> jobs(const std::string& executor, double factor) const {
    const setup::ExecutorSpec spec = setup::parse_executor(executor, {});
    const ScaledTimes scaled(*times_, factor);
    simulated::Plan plan{spec, graph_, tasks_, scaled};
    plan.duration = kLength;
    try {
      Trace trace = simulated::simulate_repetition(plan).trace;
      std::erase_if(trace.jobs, [](const JobRecord& r) { return r.outcome != Outcome::ran; });
      std::ranges::stable_sort(trace.jobs, {}, &JobRecord::start);
      std::vector<Job> jobs;
      for (const JobRecord& r : trace.jobs) jobs.push_back(r.job);
      return jobs;
    } catch (const SimulationError&) {
      return std::nullopt;
    }
  }
  [[nodiscard]] double load_percent(const std::vector<Job>& jobs, std::size_t threads) const {
    Duration work{};
    for (const Job& job : jobs) work += times_->of(job);
    return 100 * to_ms(work) / to_ms(kLength) / static_cast<double>(threads);
  }

 private:
  /// Execution times, multiplied.
  class ScaledTimes final : public ExecutionTimes {
   public:
    ScaledTimes(const ExecutionTimes& times, double factor) : times_(times), factor_(factor) {}
    Duration of(const Job& job) const override {
      return Duration(static_cast<std::int64_t>(factor_ * static_cast<double>(times_.of(job).count())));
    }

   private:
    const ExecutionTimes& times_;
    const double factor_;
  };

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::unique_ptr<ExecutionTimes> times_;
};

bool differ(const std::vector<Job>& a, const std::vector<Job>& b) {
  const auto order_of = [](const std::vector<Job>& jobs) {
    JobOrder order;
    for (const Job& job : jobs) order.push_back(job.task);
    return order;
  };
  const JobOrder x = order_of(a), y = order_of(b);
  return x != y && (1 - similarity(x, y)) * static_cast<double>(std::max(x.size(), y.size())) >= kDiffering;
}

bool needs_numbers(const std::string& executor) {
  const std::optional<Policy> policy = setup::parse_executor(executor, {}).entry->traits.policy;
  return policy == Policy::fp || policy == Policy::dm;
}

}  // namespace

std::string sentence(const Recognition& r, const RecordedGraph& graph) {
  if (r.ranking.empty()) return "No known executor runs such threads.";
  const std::string names = program::joined(r.names(), ", ");
  const Score& best = r.ranking.front();
  if (!r.stated.empty())
    return program::concat("The executor calls itself ", r.stated, ", which explains ", share_of(best, r),
                           ".");
  switch (r.verdict) {
    case Verdict::recognised:
      return program::concat(names, " explains ", share_of(best, r), next_one(r));
    case Verdict::tie:
      return tie(r);
    case Verdict::undecided:
      return undecided(r, names);
    case Verdict::none_fits: {
      std::string all = program::concat("No known executor fits: the best one, ", best.hypothesis.label,
                                        ", explains ", share_of(best, r));
      if (r.breaks)
        all += program::text(". It first breaks at %.1f ms, when %s ran", to_ms(r.breaks->at - graph.epoch),
                             graph.tasks.set[r.breaks->task].name.c_str());
      return all + ".";
    }
  }
  return {};
}

nlohmann::json recognition_json(const Recognition& r, const RecordedGraph& graph) {
  using nlohmann::json;
  json ranking = json::array();
  for (const Score& score : r.ranking) {
    ranking.push_back({{"executor", score.hypothesis.label},
                       {"agreement", score.agreement},
                       {"contradictions", score.contradictions},
                       {"margin", score.margin},
                       {"only_best_explains", score.against},
                       {"kinds_only_best_explains", score.kinds_against},
                       {"only_this_explains", score.in_favour},
                       {"only_best_explains_beyond_timing", score.plain_against},
                       {"unlikely", score.unlikely},
                       {"order_is_fitted", !score.evidence.empty()},
                       {"priorities_are_fitted", score.hypothesis.needs_levels() && r.stated.empty()}});
  }
  return {{"verdict", to_string(r.verdict)},
          {"executors", r.verdict == Verdict::none_fits ? std::vector<std::string>() : r.names()},
          {"sentence", sentence(r, graph)},
          {"stated", r.stated},
          {"decisions", r.decisions},
          {"contested", r.contested},
          {"ranking", ranking}};
}

std::string distinguishing_load(const Graph& graph, const GraphTasks& tasks,
                                std::vector<std::string> executors, std::size_t threads) {
  std::erase_if(executors, needs_numbers);
  if (executors.size() < 2) return {};
  const std::string& best = executors.front();
  const std::size_t others = executors.size() - 1;
  const LoadedGraph loaded(graph, tasks);
  const std::optional<std::vector<Job>> recorded = loaded.jobs(best, 1);
  const double load_percent = recorded ? loaded.load_percent(*recorded, threads) : 0;
  if (load_percent <= 0 || load_percent >= kLast_percent) return {};
  const int first = kStep_percent * (1 + static_cast<int>(load_percent) / kStep_percent);
  for (int percent = first; percent <= kLast_percent; percent += kStep_percent) {
    const std::optional<std::vector<Job>> reference = loaded.jobs(best, percent / load_percent);
    if (!reference) return {};
    const auto differing = std::count_if(executors.begin() + 1, executors.end(), [&](const std::string& e) {
      const std::optional<std::vector<Job>> other = loaded.jobs(e, percent / load_percent);
      return !other || differ(*reference, *other);
    });
    if (differing > 0)
      return program::text("With the threads %d %% busy (recorded: %.0f %%), ", percent, load_percent) +
             program::concat(differing, " of the other ", others, " would run jobs in another order than ",
                             best, ".");
  }
  return program::text("Simulated with the threads up to %d %% busy (recorded: %.0f %%), ", kLast_percent,
                       load_percent) +
         program::concat(best, " and the other ", others, " run this graph's jobs in nearly the same order.");
}

}  // namespace hotpath::imports
