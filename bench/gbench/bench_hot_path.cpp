// SPDX-License-Identifier: Apache-2.0
// The reference system's hot path as a Google Benchmark: each run is one repetition in fresh processes, its
// time the median latency.
#include <unistd.h>

#include "hotpath/bench/executor_spec.hpp"
#include "hotpath/bench/repetition_runner.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "live_figures.hpp"
#include "program.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;

constexpr Duration kWarmUp = 300ms;

class HotPath {
 public:
  explicit HotPath(Duration measured) : graph_(load_graph(find_graph("autoware"))), measured_(measured) {
    tasks_ = make_tasks(graph_);
    const std::vector<Duration> phases = make_phases(graph_, tasks_, Phases::creation);
    for (TaskId id = 0; id < tasks_.set.size(); ++id) tasks_.set.tasks[id].phase = phases[id];
    Duration typical{};
    for (const Node& node : graph_.nodes) typical = std::max(typical, node.execution_time);
    calibration_ = calibrate(typical);
  }

  void run(benchmark::State& state, const std::string& executor, TransportKind transport) const {
    RepetitionPlan plan;
    plan.graph = &graph_;
    plan.tasks = tasks_;
    plan.executor = parse_executor(executor, {});
    plan.transport = transport;
    plan.fastdds.partition = "bench-" + std::to_string(getpid());
    plan.length = kWarmUp + measured_;
    plan.calibration = calibration_;
    for (auto _ : state) {
      const RepetitionResult result = run_repetition(plan, [](Duration) {});
      if (!result.measured) return state.SkipWithError(("no result: " + result.failure).c_str());
      report(state, result.repetition);
    }
  }

 private:
  void report(benchmark::State& state, const Repetition& repetition) const {
    std::vector<double> latencies;
    for (const ChainRecord& c : repetition.trace.chains) {
      if (c.chain == 0) latencies.push_back(static_cast<double>(c.hot_path_latency.count()));
    }
    // The warm-up's share of them: outputs come at a constant rate.
    const auto skipped = static_cast<std::ptrdiff_t>(latencies.size()) * kWarmUp / (kWarmUp + measured_);
    latencies.erase(latencies.begin(), latencies.begin() + skipped);
    gbench::Figures figures;
    figures.add_samples("hot_path", std::move(latencies));
    state.SetIterationTime(figures.time_ns / 1e9);
    for (const auto& [name, value] : figures.counters) state.counters[name] = value;
    std::uint64_t ran = 0;
    for (const JobRecord& r : repetition.trace.jobs) ran += r.outcome == Outcome::ran ? 1 : 0;
    state.counters["cpu_per_callback_ns"] =
        static_cast<double>(repetition.usage.cpu_time.count()) / static_cast<double>(ran);
  }

  Graph graph_;
  GraphTasks tasks_;
  Calibration calibration_;
  Duration measured_;
};

}  // namespace

int main(int argc, char** argv) {
  return gbench::run_program(argc, argv, [](bool quick) {
    const auto hot_path = std::make_shared<HotPath>(quick ? 700ms : 2s);
    for (const std::string& executor : paper_executor_names()) {
      for (const TransportKind transport : {TransportKind::intra_process, TransportKind::fastdds}) {
        const std::string name = "hot_path/executor:" + executor + "/transport:" + to_string(transport);
        benchmark::RegisterBenchmark(name.c_str(),
                                     [=](benchmark::State& s) { hot_path->run(s, executor, transport); })
            ->Iterations(1)
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond);
      }
    }
  });
}
