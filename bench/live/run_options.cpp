// SPDX-License-Identifier: Apache-2.0
#include "live/run_options.hpp"

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>
#include <type_traits>
#include <utility>

#include "program/errors.hpp"
#include "setup/option_helpers.hpp"

namespace hotpath {

void add_run_options(CLI::App& command, RunOptions& o) {
  add_graph_options(command, o);
  command.add_flag("--quick", o.quick, "A short look: once, 2 s after 0.5 s of warm-up")->group(kHowLong);
  add_length_options(command, o, 86400);
  add_number(command, "--time-out", o.time_out_s, 0.1, 3600, "SECONDS",
             "A process that answers this much later than it should\nhas hung: its repetition fails")
      ->capture_default_str()
      ->group(kHowLong);

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

  const auto live = std::string("Live publishing");
  command
      .add_flag("--live", o.live,
                "Publish statistics and every hot-path sample over Fast\n"
                "DDS while it runs, from a process of its own that gives\n"
                "way to all others: topics hotpath/run, hotpath/statistics\n"
                "and hotpath/chain_samples in the domain of --domain")
      ->group(live);
  command
      .add_flag("--live-alternate", o.live_alternate,
                "As --live in the 2nd and 3rd of every four repetitions,\n"
                "and tell what it did to the median hot-path latency")
      ->excludes("--live")
      ->group(live);
  command
      .add_option("--live-cpus", o.live_cpus,
                  "Processors of the process that publishes; by default\n"
                  "those that --cpus leaves, if any")
      ->type_name("LIST")
      ->group(live);

  add_output_option(command, o);
}

std::vector<int> parse_cpus(const std::string& option, const std::string& text) {
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
      throw UsageError(option + " " + text + ": `" + part +
                       "` is not a processor number or a range like 2-3");
    }
    for (int cpu = first; cpu <= last; ++cpu) cpus.insert(cpu);
  }
  const std::vector<int> available = allowed_cpus();
  for (const int cpu : cpus) {
    if (std::find(available.begin(), available.end(), cpu) != available.end()) continue;
    std::string list;
    for (const int a : available) list += (list.empty() ? "" : ",") + std::to_string(a);
    throw UsageError(option + " " + text + ": there is no processor " + std::to_string(cpu) +
                     " for this process; there are " + list);
  }
  return {cpus.begin(), cpus.end()};
}

}  // namespace hotpath
