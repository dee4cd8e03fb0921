// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "live/live_run.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "sweep/child_run.hpp"

namespace hotpath {

namespace {

struct RunArguments {
  RunOptions options;
  std::string executor = "rm-ro";
};

void add_where_options(CLI::App& command, RunOptions& o) {
  command.option_defaults()->group("Where it runs");
  add_list(command, "--stack", o.stacks, "native|rclcpp",
           "hotpath's own executors (native), or the real ROS 2\nstack of a sourced workspace (rclcpp); "
           "compare takes both",
           CLI::IsMember(words<Stack>()));
  add_text(command, "--ros2-runner", o.ros2_runner, "FILE",
           "Program that runs the graph on rclcpp; by default\nHOTPATH_ROS2_RUNNER, or that of a sourced "
           "workspace");
  add_choice(command, "--transport", o.plan.transport,
             "What carries messages: DDS, or pointers in one process");
  add_number(command, "--processes", o.plan.processes, {1, 100}, "N",
             "Split the nodes over that many processes (fastdds only)");
  add_choice(command, "--network", o.plan.fastdds.network, "How messages get from process to process");
  command.add_flag("--all-interfaces", o.all_interfaces, "Every network interface, not loopback alone");
  add_number(command, "--domain", o.plan.fastdds.domain, {0, 232}, "N", "DDS domain");
  add_text(command, "--cpus", o.cpus, "LIST", "Processors to run on, as in 1 or 0,2-3; by default all");
  add_text(command, "--executor-policy", o.executor_policy, "POLICY",
           "Scheduling class of executor threads, other, fifo:N or\nrr:N; by default other");
  add_text(command, "--timer-policy", o.timer_policy, "POLICY",
           "The same for the timer management thread; by default\n"
           "fifo:90 under the paper's executors, where permitted");
  command.add_flag("--lock-memory", o.plan.lock_memory, "Keep all memory resident (mlockall)");
  command.add_flag("--cpu-time", o.plan.measure_cpu_time,
                   "Record the CPU time of every job (costs a microsecond)");
}

void add_live_options(CLI::App& command, RunOptions& o) {
  command.option_defaults()->group("Live publishing");
  command.add_flag("--live", o.live,
                   "Publish statistics and every hot-path sample over Fast\n"
                   "DDS while it runs, from a separate process that gives\n"
                   "way to all others: topics hotpath/run, hotpath/statistics\n"
                   "and hotpath/chain_samples in the domain of --domain");
  command
      .add_flag("--live-alternate", o.live_alternate,
                "As --live in the 2nd and 3rd of every four repetitions,\n"
                "and tell what it did to the median hot-path latency")
      ->excludes("--live");
  add_text(command, "--live-cpus", o.live_cpus, "LIST",
           "Processors of the process that publishes; by default\n"
           "those that --cpus leaves, if any");
}

/// The options that both commands share; `o` must outlive the parse.
void add_run_options(CLI::App& command, RunOptions& o) {
  add_graph_options(command, o);
  command.add_flag("--quick", o.quick, "A short look: once, 2 s after 0.5 s of warm-up")->group(kHowLong);
  add_length_options(command, o, 86400);
  add_number(command, "--repeat-disturbed", o.repeat_disturbed, {0, 100}, "N",
             "Measure a repetition again, at most N times, whose\nprocessor was slow for a while; the least "
             "disturbed\nattempt counts, the others are kept");
  exclude(command, "--quick", {"--duration", "--warm-up", "--repetitions"});
  add_number(command, "--time-out", o.time_out_s, {0.1, 3600}, "SECONDS",
             "A process that answers this much later than it should\nhas hung: its repetition fails. Setting "
             "up thousands\nof nodes may take longer");
  add_where_options(command, o);
  add_live_options(command, o);
  add_output_option(command, o);
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto [run, o] = add_command<RunArguments>(app, "run", "Measure a graph live under one executor",
                                            "hotpath run --executor edf-ro --duration 10 --output runs/first",
                                            [](RunArguments& arguments) {
                                              const bool deployed = !arguments.options.deployments.empty();
                                              if (!deployed)
                                                arguments.options.executors = {arguments.executor};
                                              run_live(arguments.options);
                                            });
  add_text(run, "--executor,--executors", o.executor, "NAME", "One of `hotpath list executors`")
      ->group(kWhatRuns);
  add_deployments_option(run, o.options);
  exclude(run, "--executor", {"--deployments"});
  add_run_options(run, o.options);
}

namespace {

struct CompareArguments {
  RunOptions options;
  std::string against, junit, markdown;
};

/// Measures two builds by turns, each repetition in a process and a folder of its own, and lets the gate
/// judge. `words`: the options of both.
void compare_builds(const CompareArguments& a, const std::vector<std::string>& words) {
  const std::filesystem::path folder =
      a.options.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-against" : a.options.output;
  check_output_folder(folder);
  if (a.options.repetitions < 3)
    throw UsageError("--against: a gate needs --repetitions 3 or more, better 20");
  const auto order = interleaved(a.options.repetitions, 2, a.options.seed);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto [repetition, build] = order[i];
    const char* const name = build == 0 ? "new" : "old";
    std::cerr << text("[%zu/%zu] %s build, repetition %u\n", i + 1, order.size(), name, repetition);
    std::vector<std::string> all = {"compare"};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"--repetitions=1", concat("--seed=", a.options.seed + repetition),
                           concat("--output=", (folder / name / text("%04u", repetition)).string())});
    try {
      run_hotpath(all, build == 0 ? "" : a.against);
    } catch (const UsageError& error) {
      throw UsageError(concat(name, " build, repetition ", repetition, ": ", error.what()));
    } catch (const RunError& error) {
      throw RunError(concat(name, " build, repetition ", repetition, ": ", error.what()));
    }
  }
  std::vector<std::string> gate = {folder / "old", folder / "new", "--gate"};
  if (!a.junit.empty()) gate.push_back("--junit=" + a.junit);
  if (!a.markdown.empty()) gate.push_back("--markdown=" + a.markdown);
  become_python_tool("compare-results", gate);
}

}  // namespace

void add_compare_command(CLI::App& app) {
  auto self = std::make_shared<const CLI::App*>();
  auto [compare, arguments] = add_command<CompareArguments>(
      app, "compare", "Measure a graph live under several executors, repetitions interleaved",
      "hotpath compare --executors default,rm-ro,edf-ro --duration 10", [self](CompareArguments& a) {
        if (!a.against.empty()) {
          const std::vector<std::string> own = {"against",     "junit", "markdown",
                                                "repetitions", "seed",  "output"};
          compare_builds(a, given_options(**self, own));
        }
        a.options.executors = executors_of(a.options);
        run_live(a.options);
      });
  *self = &compare;
  RunOptions& o = arguments.options;
  add_executors_option(compare, "--executors", o);
  o.repetitions = 3;
  add_run_options(compare, o);
  compare.option_defaults()->group("Two builds");
  CLI::Option* const against = add_text(
      compare, "--against", arguments.against, "HOTPATH",
      "Another build of this program: repetitions of both by\nturns, then `compare-results --gate` of "
      "this one\nagainst the other; exit code 1 if anything became worse");
  exclude(compare, "--against", {"--quick"});
  add_output_file(compare, "--junit", arguments.junit, "Of the gate: test cases for CI")->needs(against);
  add_output_file(compare, "--markdown", arguments.markdown, "Of the gate: a summary for a pull request")
      ->needs(against);
}

}  // namespace hotpath
