// SPDX-License-Identifier: Apache-2.0
#include "run_options.hpp"

#include <charconv>
#include <map>
#include <set>
#include <sstream>

#include "hotpath/bench/errors.hpp"

namespace hotpath {

namespace {

template <class Enum>
CLI::CheckedTransformer choice(const std::vector<Enum>& values) {
  std::map<std::string, Enum> names;
  for (const Enum v : values) names.emplace(to_string(v), v);
  return CLI::CheckedTransformer(names);
}

const std::map<std::string, WorkMode> kWorkModes = {
    {"fixed", WorkMode::fixed}, {"wall", WorkMode::wall}, {"cpu_time", WorkMode::cpu_time}};
const std::map<std::string, FastDdsOptions::Network> kNetworks = {
    {"udp", FastDdsOptions::Network::udp}, {"shared_memory", FastDdsOptions::Network::shared_memory}};

}  // namespace

void add_run_options(CLI::App& command, RunOptions& o) {
  const auto what = std::string("What runs");
  command.add_option("--graph", o.graph, "Name of a graph (`hotpath list graphs`) or path of a YAML file")
      ->capture_default_str()
      ->group(what);
  command
      .add_option("--load", o.load_percent,
                  "Work of all nodes in percent of one core; 0: none; default: as the graph says")
      ->check(CLI::Range(0.0, 10000.0))
      ->group(what);
  command
      .add_option("--work", o.work,
                  "How work is burnt: a fixed amount, until an instant of the clock, or CPU time")
      ->transform(CLI::CheckedTransformer(kWorkModes))
      ->group(what);
  command
      .add_option(
          "--phases", o.phases,
          "First timestamps of the timers: in creation order as rclcpp, all at once, from the graph file, "
          "or random")
      ->transform(choice<Phases>({Phases::creation, Phases::synchronous, Phases::given, Phases::random}))
      ->default_str("creation")
      ->group(what);
  command
      .add_option("--phases-file", o.phases_file, "With --phases given: a CSV file with the timers' phases")
      ->group(what);
  command.add_option("--phase-step", o.phase_step_ms, "With --phases creation: ms from one node to the next")
      ->check(CLI::NonNegativeNumber)
      ->group(what);
  command.add_option("--rule", o.rule, "Priority of subscriptions in the paper's executors")
      ->transform(choice<SubscriptionRule>({SubscriptionRule::inherit, SubscriptionRule::first}))
      ->default_str("inherit")
      ->group(what);
  command.add_option("--ties", o.ties, "Order at equal priority in the paper's executors")
      ->transform(choice<Ties>({Ties::lifo, Ties::fifo}))
      ->default_str("lifo")
      ->group(what);

  const auto how_long = std::string("How long");
  command.add_option("--duration", o.duration_s, "Seconds measured per repetition")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str()
      ->group(how_long);
  command.add_option("--warm-up", o.warm_up_s, "Seconds before that, left out of latencies")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->group(how_long);
  command.add_option("--repetitions", o.repetitions, "Runs per executor, each in fresh processes")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str()
      ->group(how_long);
  command.add_option("--seed", o.seed, "Order of repetitions, random phases, intervals")
      ->capture_default_str()
      ->group(how_long);
  command.add_flag("--quick", o.quick, "A short look: 2 s after 0.5 s of warm-up, one repetition")
      ->group(how_long);

  const auto where = std::string("Where it runs");
  command.add_option("--transport", o.transport, "What carries samples")
      ->transform(choice<TransportKind>({TransportKind::fastdds, TransportKind::intra_process}))
      ->default_str("fastdds")
      ->group(where);
  command.add_option("--processes", o.processes, "Split the nodes over this many processes (fastdds only)")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->group(where);
  command.add_option("--network", o.network, "Fast DDS between processes")
      ->transform(CLI::CheckedTransformer(kNetworks))
      ->default_str("udp")
      ->group(where);
  command
      .add_flag("--all-interfaces", o.all_interfaces,
                "Fast DDS on every network interface, not loopback alone")
      ->group(where);
  command.add_option("--domain", o.domain, "DDS domain")
      ->check(CLI::Range(0, 232))
      ->capture_default_str()
      ->group(where);
  command.add_option("--cpus", o.cpus, "Processors to run on, such as 1 or 0,2-3; default: all")
      ->group(where);
  command
      .add_option("--executor-policy", o.executor_policy,
                  "Scheduling class of executor threads: other, fifo:N, rr:N")
      ->group(where);
  command
      .add_option(
          "--timer-policy", o.timer_policy,
          "Scheduling class of the timer management thread; default: fifo:90 in the paper's executors if "
          "permitted")
      ->group(where);
  command.add_flag("--lock-memory", o.lock_memory, "mlockall")->group(where);
  command
      .add_flag("--cpu-time", o.measure_cpu_time,
                "Measure the CPU time of every job (costs about a microsecond)")
      ->group(where);

  command.add_option("--output", o.output, "Folder for the results; default: runs/<date>-<graph>")
      ->group("Results");
}

std::vector<int> parse_cpus(const std::string& text) {
  std::set<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const char* const end = part.data() + part.size();
    int first = -1, last = -1;
    auto parsed = std::from_chars(part.data(), end, first);
    last = first;
    if (parsed.ec == std::errc{} && parsed.ptr != end && *parsed.ptr == '-') {
      parsed = std::from_chars(parsed.ptr + 1, end, last);
    }
    if (parsed.ec != std::errc{} || parsed.ptr != end || first < 0 || last < first || last > 4095) {
      throw UsageError("--cpus " + text + ": `" + part + "` is not a processor number or a range like 2-3");
    }
    for (int cpu = first; cpu <= last; ++cpu) cpus.insert(cpu);
  }
  return {cpus.begin(), cpus.end()};
}

}  // namespace hotpath
