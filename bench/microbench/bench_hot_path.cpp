// SPDX-License-Identifier: Apache-2.0
// The reference system as a Google Benchmark: each run is one repetition in fresh processes. hot_path's time
// is the median latency; callback's is the CPU time of one callback of a graph without work, beside that of
// the same graph on Fast DDS alone.
#include <unistd.h>

#include "hotpath/live/clock.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "live/repetition_runner.hpp"
#include "microbench/measurement.hpp"
#include "microbench/raw_graph.hpp"
#include "setup/executor_spec.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;

constexpr Duration kWarmUp = 300ms;

class Runs {
 public:
  Runs(Graph graph, Duration measured) : graph_(std::move(graph)), measured_(measured) {
    tasks_ = make_tasks(graph_);
    const std::vector<Duration> phases = make_phases(graph_, tasks_, Phases::creation);
    for (TaskId id = 0; id < tasks_.set.size(); ++id) tasks_.set.tasks[id].phase = phases[id];
    Duration typical{};
    for (const Node& node : graph_.nodes) typical = std::max(typical, node.execution_time);
    calibration_ = calibrate(typical);
  }

  void hot_path(benchmark::State& state, const std::string& executor, TransportKind transport) const {
    repeat(state, executor, transport, [&](const Repetition& repetition) {
      std::vector<double> latencies;
      for (const ChainRecord& c : repetition.trace.chains) {
        if (c.chain == 0) latencies.push_back(gbench::ns(c.hot_path_latency));
      }
      // The warm-up's share of them: outputs come at a constant rate.
      const double share = gbench::ns(kWarmUp) / gbench::ns(kWarmUp + measured_);
      return gbench::Measurement{}.add_samples("hot_path", gbench::warm(std::move(latencies), share));
    });
  }

  void callback(benchmark::State& state, const std::string& executor, TransportKind transport) const {
    repeat(state, executor, transport, [](const Repetition& repetition) {
      std::uint64_t ran = 0;
      for (const JobRecord& r : repetition.trace.jobs) ran += r.outcome == Outcome::ran ? 1 : 0;
      return cpu_per_callback(repetition.usage.cpu_time, ran);
    });
  }

  gbench::Measurement raw_callback() const {
    const Time epoch = now() + 500ms;
    gbench::RawGraph raw(graph_, tasks_, fastdds_options(), epoch);
    std::this_thread::sleep_until(epoch);
    const Duration before = gbench::process_cpu_time();
    raw.start();
    std::this_thread::sleep_until(epoch + kWarmUp + measured_);
    raw.stop();
    return cpu_per_callback(gbench::process_cpu_time() - before, raw.callbacks());
  }

 private:
  static gbench::Measurement cpu_per_callback(Duration cpu, std::uint64_t callbacks) {
    const auto number = static_cast<double>(callbacks);
    const double each = gbench::ns(cpu) / number;
    return {each, {{"cpu_per_callback_ns", each}, {"callbacks", number}}};
  }

  static FastDdsOptions fastdds_options() {
    FastDdsOptions options;
    options.partition = "bench-" + std::to_string(getpid());
    return options;
  }

  void repeat(benchmark::State& state, const std::string& executor, TransportKind transport,
              const std::function<gbench::Measurement(const Repetition&)>& measure) const {
    RepetitionPlan plan;
    plan.graph = &graph_;
    plan.tasks = tasks_;
    plan.executor = parse_executor(executor, {});
    plan.transport = transport;
    plan.fastdds = fastdds_options();
    plan.length = kWarmUp + measured_;
    plan.calibration = calibration_;
    for (auto _ : state) {
      const RepetitionResult result = run_repetition(plan, [](Duration) {});
      if (!result.measured) return state.SkipWithError(("no result: " + result.failure).c_str());
      measure(result.repetition).report(state);
    }
  }

  Graph graph_;
  GraphTasks tasks_;
  Calibration calibration_;
  Duration measured_;
};

}  // namespace

int main(int argc, char** argv) {
  return gbench::run_program(argc, argv, [](bool quick) {
    const Duration measured = quick ? 700ms : 2s;
    Graph graph = load_graph(find_graph("autoware"));
    const auto working = std::make_shared<Runs>(graph, measured);
    scale_to_load(graph, 0);
    const auto idle = std::make_shared<Runs>(graph, measured);
    const auto add = [](const std::string& name, const std::function<void(benchmark::State&)>& run) {
      return benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(1)->UseManualTime();
    };
    for (const std::string& executor : paper_executor_names()) {
      for (const TransportKind transport : {TransportKind::intra_process, TransportKind::fastdds}) {
        const std::string variant = "/executor:" + executor + "/transport:" + to_string(transport);
        add("hot_path" + variant, [=](benchmark::State& s) {
          working->hot_path(s, executor, transport);
        })->Unit(benchmark::kMillisecond);
        add("callback" + variant, [=](benchmark::State& s) {
          idle->callback(s, executor, transport);
        })->Unit(benchmark::kMicrosecond);
      }
    }
    gbench::register_isolated("callback/raw_fastdds", [=] {
      return idle->raw_callback();
    })->Unit(benchmark::kMicrosecond);
  });
}
