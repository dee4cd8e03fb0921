// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/bench/executor_spec.hpp"
#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath {

/// What `run` and `compare` are told on the command line.
struct RunOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors;
  double duration_s = 30, warm_up_s = 2;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  double time_out_s = 20;  ///< For set-up, and for answers after the end of a repetition.
  std::optional<double> load_percent;
  std::optional<WorkMode> work;
  Phases phases = Phases::creation;
  std::string phases_file;
  std::optional<double> phase_step_ms;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;

  TransportKind transport = TransportKind::fastdds;
  FastDdsOptions::Network network = FastDdsOptions::Network::udp;
  bool all_interfaces = false;
  std::uint32_t domain = 0;
  std::uint32_t processes = 1;
  std::string cpus;
  bool lock_memory = false, measure_cpu_time = false;
  std::string executor_policy, timer_policy;

  std::string output;
  bool quick = false;
};

/// Adds the options that both commands share; `options` must outlive the parse.
void add_run_options(CLI::App& command, RunOptions& options);

/// `0,2-3` as a sorted list without duplicates. Throws UsageError.
std::vector<int> parse_cpus(const std::string& text);

}  // namespace hotpath
