// SPDX-License-Identifier: Apache-2.0
// The reference system as a Google Benchmark: each run is one repetition in fresh processes. hot_path's time
// is the median latency; callback's is the CPU time of one callback of a graph without work, beside that of
// the same graph on Fast DDS alone.
#include <Message4kbPubSubTypes.h>
#include <unistd.h>

#include <deque>
#include <map>

#include "hotpath/live/clock.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/message.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "live/repetition_runner.hpp"
#include "microbench/measurement.hpp"
#include "microbench/raw_executor.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::gbench {
namespace {

constexpr Duration kWarmUp = 300ms;

/// The yardstick of a whole graph without work: its topics, timers and message sizes over Fast DDS, with the
/// threads of a live executor and none of our code, and with nodes that only pass data on. (What they publish
/// is left as the loan came.)
class RawGraph {
 public:
  /// First timestamps are the phases in `tasks`, relative to `epoch`. Throws TransportError.
  RawGraph(const Graph& graph, const GraphTasks& tasks, const FastDdsOptions& options, Time epoch)
      : participant_(options) {
    participant_.register_type(eprosima::fastdds::dds::TypeSupport(new msg::Message4kbPubSubType));
    std::map<std::string, std::uint32_t> readers, writers;
    for (const Node& node : graph.nodes) {
      for (const Input& input : node.inputs) ++readers[input.topic];
      for (const std::string& output : node.outputs) ++writers[output];
    }
    for (const Node& node : graph.nodes) {
      RawNode& raw = nodes_.emplace_back();
      for (const std::string& output : node.outputs) {
        raw.writers.push_back(participant_.add_writer(output, 1, readers[output]));
      }
    }
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const TaskOrigin origin = tasks.origin[id];
      const Node& node = graph.nodes[origin.node];
      RawNode& raw = nodes_[origin.node];
      if (origin.input) {
        const Input& input = node.inputs[*origin.input];
        executor_.add_reader(participant_, input.topic, input.depth, writers[input.topic],
                             subscription(node, raw, *origin.input));
      } else {
        executor_.add_timer(epoch + tasks.set[id].phase, node.period, [this, &raw] {
          ++callbacks_;
          publish(*raw.writers.front());
        });
      }
    }
    participant_.wait_until_matched(now() + std::chrono::seconds(10));
  }

  void start() { executor_.start(); }
  void stop() { executor_.stop(); }

  /// Timers and samples handled until stop().
  std::uint64_t callbacks() const { return callbacks_; }

 private:
  using Executor = RawExecutor<msg::Message4kb>;

  struct RawNode {
    std::vector<eprosima::fastdds::dds::DataWriter*> writers;
    std::uint32_t inputs_seen = 0;  // of a fusion, since its last publication
  };

  Executor::OnSample subscription(const Node& node, RawNode& raw, std::uint32_t input) {
    const bool passes_on = node.type == NodeType::transform || node.type == NodeType::intersection;
    auto* const writer = passes_on                       ? raw.writers[input]
                         : node.type == NodeType::fusion ? raw.writers.front()
                                                         : nullptr;
    // A fusion publishes when each of its inputs has come, the others with every sample.
    const std::uint32_t own = passes_on ? 0 : 1U << input,
                        all = passes_on ? 0 : (1U << node.inputs.size()) - 1;
    return [this, &raw, writer, own, all](const msg::Message4kb&) {
      ++callbacks_;
      raw.inputs_seen |= own;
      if (writer == nullptr || raw.inputs_seen != all) return;
      raw.inputs_seen = 0;
      publish(*writer);
    };
  }

  static void publish(eprosima::fastdds::dds::DataWriter& writer) { writer.write(borrow_raw(writer)); }

  std::deque<RawNode> nodes_;
  Executor executor_;
  FastDdsParticipant participant_;
  std::uint64_t callbacks_ = 0;
};

class Runs {
 public:
  Runs(Graph graph, Duration measured) : graph_(std::move(graph)), measured_(measured) {
    tasks_ = make_tasks(graph_);
    set_phases(tasks_.set, make_phases(graph_, tasks_, Phases::creation));
    Duration typical{};
    for (const Node& node : graph_.nodes) typical = std::max(typical, node.execution_time);
    calibration_ = calibrate(typical);
  }

  void hot_path(benchmark::State& state, const std::string& executor, TransportKind transport) const {
    repeat(state, executor, transport, [&](const Repetition& repetition) {
      std::vector<double> latencies;
      for (const ChainRecord& c : repetition.trace.chains) {
        if (c.chain == 0) latencies.push_back(ns(c.hot_path_latency));
      }
      // The warm-up's share of them: outputs come at a constant rate.
      const double share = ns(kWarmUp) / ns(kWarmUp + measured_);
      return Measurement{}.add_samples("hot_path", warm(std::move(latencies), share));
    });
  }

  void callback(benchmark::State& state, const std::string& executor, TransportKind transport) const {
    repeat(state, executor, transport, [](const Repetition& repetition) {
      std::uint64_t ran = 0;
      for (const JobRecord& r : repetition.trace.jobs) ran += r.outcome == Outcome::ran ? 1 : 0;
      return cpu_per_callback(repetition.usage.cpu_time, ran);
    });
  }

  Measurement raw_callback() const {
    const Time epoch = now() + 500ms;
    RawGraph raw(graph_, tasks_, fastdds_options(), epoch);
    std::this_thread::sleep_until(epoch);
    const Duration before = process_cpu_time();
    raw.start();
    std::this_thread::sleep_until(epoch + kWarmUp + measured_);
    raw.stop();
    return cpu_per_callback(process_cpu_time() - before, raw.callbacks());
  }

 private:
  static Measurement cpu_per_callback(Duration cpu, std::uint64_t callbacks) {
    const auto number = static_cast<double>(callbacks);
    const double each = ns(cpu) / number;
    return {each, {{"cpu_per_callback_ns", each}, {"callbacks", number}}};
  }

  static FastDdsOptions fastdds_options() {
    FastDdsOptions options;
    options.partition = "bench-" + std::to_string(getpid());
    return options;
  }

  void repeat(benchmark::State& state, const std::string& executor, TransportKind transport,
              const std::function<Measurement(const Repetition&)>& measure) const {
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

void register_all(bool quick) {
  const Duration measured = quick ? 700ms : 2s;
  Graph graph = load_graph(find_graph("autoware"));
  const auto working = std::make_shared<Runs>(graph, measured);
  scale_to_load(graph, 0);
  const auto idle = std::make_shared<Runs>(graph, measured);
  const auto add = [](const std::string& name, const std::function<void(benchmark::State&)>& run) {
    return benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(1)->UseManualTime();
  };
  std::vector<std::string> executors = paper_executor_names();
  executors.emplace_back("cbg:1");
  for (const std::string& executor : executors) {
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
  register_isolated("callback/raw_fastdds", [=] {
    return idle->raw_callback();
  })->Unit(benchmark::kMicrosecond);
}

}  // namespace hotpath::gbench
