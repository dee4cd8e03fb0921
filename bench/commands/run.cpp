// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "live/live_run.hpp"
#include "program/child_process.hpp"

namespace hotpath::commands {

namespace {

void add_where_options(CLI::App& command, live::Options& o) {
  command.option_defaults()->group("Environment");
  const auto set_stacks = [&o](const std::vector<std::string>& names) {
    o.stacks.clear();
    for (const std::string& name : names) o.stacks.push_back(value_of<setup::Stack>("--stack", name));
  };
  add_list(command, "--stack", set_stacks, joined(words<setup::Stack>(), "|"),
           "hotpath's own executors (native), or the ROS 2 stack of a sourced workspace (rclcpp), or both")
      ->default_str(to_string(setup::Stack::native));
  add_list(command, "--rmw", o.rmw, "NAMES",
           "Middlewares of --stack rclcpp, separated by commas, such as fastrtps,cyclonedds: each executor "
           "runs on each of them; by default that of RMW_IMPLEMENTATION or of ROS 2");
  add(command, "--transport", o.plan.transport, "Message transport: DDS, or pointers within one process");
  add(command, "--processes", o.plan.processes, {1, 100}, "N",
      "Processes that share the nodes (fastdds only)");
  add(command, "--network", o.plan.fastdds.network, "DDS transport between processes");
  add(command, "--all-interfaces", o.plan.all_interfaces, kAllInterfacesHelp);
  add(command, "--domain", o.plan.fastdds.domain, {0, 232}, "N", kDomainHelp);
  add_parsed(command, "--cpus", o.plan.cpus, live::parse_cpus, "LIST",
             "CPUs to run on, such as 1 or 0,2-3; by default all")
      ->check(not_empty());
  add_parsed(command, "--executor-policy", o.plan.executor_policy, live::parse_policy, "POLICY",
             "Scheduling class of executor threads: other, fifo:N or rr:N; by default other")
      ->check(not_empty());
  add_parsed(command, "--timer-policy", o.plan.timer_policy, live::parse_policy, "POLICY",
             "Scheduling class of the timer management thread; by default fifo:90 under the paper's "
             "executors if permitted")
      ->check(not_empty());
  add(command, "--lock-memory", o.plan.lock_memory, "Lock all memory in RAM (mlockall)");
  command.option_defaults()->group("Live publishing");
  add(command, "--live", o.live,
      "Publish statistics and every hot-path sample over Fast DDS during the run, from a separate "
      "low-priority process; topics hotpath/run, hotpath/statistics and hotpath/chain_samples in the domain "
      "of --domain");
}

/// Alternates between two builds, each repetition in its own process and folder, then runs the
/// gate. `words`: the options of both.
void compare_builds(const RunOptions& a, const std::vector<std::string>& words) {
  const std::filesystem::path folder = setup::output_folder(a.output, "against");
  program::check_output_folder(folder);
  if (a.repetitions < 3) throw UsageError("--against: the gate needs --repetitions 3 or more, preferably 20");
  const auto order = setup::interleaved(a.repetitions, 2, a.seed);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto [repetition, build] = order[i];
    const char* const name = build == 0 ? "new" : "old";
    std::cerr << text("[%zu/%zu] %s build, repetition %u\n", i + 1, order.size(), name, repetition);
    std::vector<std::string> all = {"run"};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"--repetitions=1", concat("--seed=", a.seed + repetition),
                           concat("--output=", (folder / name / text("%04u", repetition)).string())});
    const std::string place = concat(name, " build, repetition ", repetition, ": ");
    try {
      program::run_hotpath(all, build == 0 ? "" : a.against);
    } catch (const UsageError& error) {
      throw UsageError(place + error.what());
    } catch (const RunError& error) {
      throw RunError(place + error.what());
    }
  }
  std::vector<std::string> gate = {program::own_program(), "diff", (folder / "old").string(),
                                   (folder / "new").string(), "--gate"};
  if (!a.junit.empty()) gate.push_back("--junit=" + a.junit);
  if (!a.markdown.empty()) gate.push_back("--markdown=" + a.markdown);
  program::become(gate);
}

}  // namespace

void add_run_options(CLI::App& run, RunOptions& o) {
  add_executors_option(run, o);
  o.repetitions = 3;
  add_graph_options(run, o);
  add(run, "--quick", o.quick, "Short run: 1 repetition of 2 s after 0.5 s of warm-up")
      ->group(kDurationGroup);
  add_length_options(run, o, 86400);
  run.get_option("--quick")->excludes("--duration", "--warm-up", "--repetitions");
  add(run, "--time-out", o.time_out_s, {0.1, 3600}, "SECONDS",
      "Lateness after which a process counts as hung and its repetition fails; raise it for thousands of "
      "nodes");
  add_where_options(run, o);
  add_output_option(run, o);
  add_json_option(run);
  run.option_defaults()->group("Two builds");
  CLI::Option* const against =
      add(run, "--against", o.against, "HOTPATH",
          "Another build of this program: alternate the repetitions of both builds, then run `diff --gate` "
          "with the other build as baseline; exit code 1 on a regression");
  run.get_option("--against")->excludes("--quick", "--json");
  add_output_file(run, "--junit", o.junit, kJunitHelp)->needs(against);
  add_output_file(run, "--markdown", o.markdown, kMarkdownHelp)->needs(against);
}

const Command kRun("Measure", 10, [](CLI::App& app) {
  auto [run, o] = add_command<RunOptions>(
      app, "run", "Measure a graph live under several executors, repetitions interleaved",
      "hotpath run autoware --executors default,rm-ro,edf-ro --duration 10",
      [](const CLI::App& command, RunOptions& options) {
        if (!options.against.empty()) {
          return compare_builds(options, given_options(command, {"against", "junit", "markdown",
                                                                 "repetitions", "seed", "output"}));
        }
        options.executors = executors_of(options);
        live::run_live(options);
      });
  add_run_options(run, o);
  show_first(run, {"--executors", "--set", "--quick", "--duration", "--stack", "--output"});
});

}  // namespace hotpath::commands
