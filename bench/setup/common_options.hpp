// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/reference_system/phases.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

/// What live and simulated experiments are told on the command line.
struct CommonOptions {
  std::string graph = "autoware";
  std::vector<std::string> executors;
  double duration_s = 30, warm_up_s = 2;
  std::uint32_t repetitions = 1;
  std::uint64_t seed = 1;
  std::optional<double> load_percent;
  std::optional<WorkMode> work;
  Phases phases = Phases::creation;
  std::string phases_file;
  std::optional<double> phase_step_ms;
  SubscriptionRule rule = SubscriptionRule::inherit;
  Ties ties = Ties::lifo;
  std::string output;
};

/// The names of the options' groups in the help.
inline constexpr const char* kWhatRuns = "What runs";
inline constexpr const char* kHowLong = "How long";

/// Adds --graph, --load, --work, the phases, --rule and --ties; `options` must outlive the parse.
void add_graph_options(CLI::App& command, CommonOptions& options);

/// Adds --duration up to `longest_s`, --warm-up, --repetitions and --seed.
void add_length_options(CLI::App& command, CommonOptions& options, double longest_s);

void add_output_option(CLI::App& command, CommonOptions& options);

}  // namespace hotpath
