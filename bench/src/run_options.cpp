// SPDX-License-Identifier: Apache-2.0
#include "run_options.hpp"

#include <charconv>
#include <set>
#include <sstream>
#include <type_traits>
#include <utility>

#include "hotpath/bench/errors.hpp"

namespace hotpath {

namespace {

template <class Enum>
using Named = std::vector<std::pair<std::string, Enum>>;

template <class Enum>
Named<Enum> named(std::initializer_list<Enum> values) {
  Named<Enum> names;
  for (const Enum v : values) names.emplace_back(to_string(v), v);
  return names;
}

/// An option that takes one of a few words, which stand in the help in place of the type.
template <class Enum, class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& option, Value& value, const Named<Enum>& names,
                        const std::string& help) {
  std::vector<std::string> words;
  std::string list;
  for (const auto& [word, meaning] : names) {
    words.push_back(word);
    list += (list.empty() ? "" : "|") + word;
  }
  const auto set = [&value, names](const std::string& text) {
    for (const auto& [word, meaning] : names) {
      if (word == text) value = meaning;
    }
  };
  return command.add_option_function<std::string>(option, set, help)
      ->check(CLI::IsMember(words).description(""))
      ->type_name(list);
}

template <class Value>
CLI::Option* add_number(CLI::App& command, const std::string& option, Value& value, double least, double most,
                        const std::string& unit, const std::string& help) {
  const char* const kind = std::is_integral_v<Value> ? "whole number" : "number";
  const auto check = [least, most, kind](const std::string& text) {
    std::conditional_t<std::is_integral_v<Value>, std::int64_t, double> number{};
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, number);
    const auto n = static_cast<double>(number);
    if (parsed.ec == std::errc{} && parsed.ptr == end && n >= least && n <= most) return std::string();
    std::ostringstream range;
    range << "`" << text << "` is not a " << kind << " from " << least << " to " << most;
    return range.str();
  };
  return command.add_option(option, value, help)->check(CLI::Validator(check, ""))->type_name(unit);
}

}  // namespace

void add_run_options(CLI::App& command, RunOptions& o) {
  const auto what = std::string("What runs");
  command.add_option("--graph", o.graph, "A name (`hotpath list graphs`), or the path of a YAML file")
      ->type_name("GRAPH")
      ->capture_default_str()
      ->group(what);
  add_number(command, "--load", o.load_percent, 0, 10000, "PERCENT",
             "Work of all nodes in percent of one core, 0 for none;\nby default what the graph says")
      ->group(what);
  add_choice<WorkMode>(
      command, "--work", o.work,
      {{"fixed", WorkMode::fixed}, {"wall", WorkMode::wall}, {"cpu_time", WorkMode::cpu_time}},
      "How a node works: a fixed amount, for a span of time, or\nof CPU time; by default what the graph says")
      ->group(what);
  add_choice(command, "--phases", o.phases,
             named({Phases::creation, Phases::synchronous, Phases::given, Phases::random}),
             "When timers start: one after another as under rclcpp,\n"
             "all at once, as the graph file says, or at random")
      ->default_str("creation")
      ->group(what);
  command.add_option("--phases-file", o.phases_file, "As `--phases given`, from a CSV file: see the README")
      ->type_name("FILE")
      ->group(what);
  add_number(command, "--phase-step", o.phase_step_ms, 0, 1e6, "MS",
             "With `--phases creation`: time from one node to the next;\n"
             "by default what rclcpp needs for it")
      ->group(what);
  add_choice(command, "--rule", o.rule, named({SubscriptionRule::inherit, SubscriptionRule::first}),
             "Subscriptions under the paper's executors: priority of\n"
             "the timers upstream, or before all timers")
      ->default_str("inherit")
      ->group(what);
  add_choice(command, "--ties", o.ties, named({Ties::lifo, Ties::fifo}),
             "At equal priority: latest or earliest activation first")
      ->default_str("lifo")
      ->group(what);

  const auto how_long = std::string("How long");
  command.add_flag("--quick", o.quick, "A short look: once, 2 s after 0.5 s of warm-up")->group(how_long);
  add_number(command, "--duration", o.duration_s, 0.1, 86400, "SECONDS", "Measured time of each repetition")
      ->capture_default_str()
      ->group(how_long);
  add_number(command, "--warm-up", o.warm_up_s, 0, 3600, "SECONDS",
             "Time before that, whose latencies do not count")
      ->capture_default_str()
      ->group(how_long);
  add_number(command, "--repetitions", o.repetitions, 1, 10000, "N",
             "Repetitions per executor, each in fresh processes")
      ->capture_default_str()
      ->group(how_long);
  command
      .add_option("--seed", o.seed,
                  "Decides the order of repetitions, random phases and\nresampling for the intervals")
      ->type_name("N")
      ->capture_default_str()
      ->group(how_long);
  add_number(command, "--time-out", o.time_out_s, 0.1, 3600, "SECONDS",
             "A process that answers this much later than it should\nhas hung: its repetition fails")
      ->capture_default_str()
      ->group(how_long);

  const auto where = std::string("Where it runs");
  add_choice(command, "--transport", o.transport,
             named({TransportKind::fastdds, TransportKind::intra_process}),
             "What carries messages: DDS, or pointers in one process")
      ->default_str("fastdds")
      ->group(where);
  add_number(command, "--processes", o.processes, 1, 64, "N",
             "Split the nodes over that many processes (fastdds only)")
      ->capture_default_str()
      ->group(where);
  add_choice<FastDdsOptions::Network>(
      command, "--network", o.network,
      {{"udp", FastDdsOptions::Network::udp}, {"shared_memory", FastDdsOptions::Network::shared_memory}},
      "How messages get from process to process")
      ->default_str("udp")
      ->group(where);
  command.add_flag("--all-interfaces", o.all_interfaces, "Every network interface, not loopback alone")
      ->group(where);
  add_number(command, "--domain", o.domain, 0, 232, "N", "DDS domain")->capture_default_str()->group(where);
  command.add_option("--cpus", o.cpus, "Processors to run on, as in 1 or 0,2-3; by default all")
      ->type_name("LIST")
      ->group(where);
  command
      .add_option("--executor-policy", o.executor_policy,
                  "Scheduling class of executor threads, other, fifo:N or\nrr:N; by default other")
      ->type_name("POLICY")
      ->group(where);
  command
      .add_option("--timer-policy", o.timer_policy,
                  "The same for the timer management thread; by default\n"
                  "fifo:90 under the paper's executors, where permitted")
      ->type_name("POLICY")
      ->group(where);
  command.add_flag("--lock-memory", o.lock_memory, "Keep all memory resident (mlockall)")->group(where);
  command
      .add_flag("--cpu-time", o.measure_cpu_time, "Record the CPU time of every job (costs a microsecond)")
      ->group(where);

  command.add_option("--output", o.output, "New folder for the results; by default runs/DATE-GRAPH")
      ->type_name("FOLDER")
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
