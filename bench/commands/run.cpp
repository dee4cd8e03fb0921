// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "commands/commands.hpp"
#include "live/live_run.hpp"

namespace hotpath {

namespace {

struct Arguments {
  RunOptions options;
  std::string executor = "rm-ro";
};

}  // namespace

void add_run_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* run = app.add_subcommand("run", "Measure a graph live under one executor");
  run->add_option("--executor,--executors", arguments->executor, "One of `hotpath list executors`")
      ->type_name("NAME")
      ->capture_default_str()
      ->group("What runs");
  add_run_options(*run, arguments->options);
  run->footer("Example:  hotpath run --executor edf-ro --duration 10 --output runs/first");
  run->callback([arguments] {
    arguments->options.executors = {arguments->executor};
    run_experiment(arguments->options);
  });
}

void add_compare_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* compare =
      app.add_subcommand("compare", "Measure a graph live under several executors, repetitions interleaved");
  compare
      ->add_option("--executors", arguments->options.executors,
                   "Names of `hotpath list executors` with commas between,\n"
                   "also variants as in rm-ro:first or multi:4; or `paper`\n"
                   "(the paper's seven, by default) or `all`")
      ->type_name("NAMES")
      ->delimiter(',')
      ->group("What runs");
  arguments->options.repetitions = 3;
  add_run_options(*compare, arguments->options);
  compare->footer("Example:  hotpath compare --executors default,rm-ro,edf-ro --duration 10");
  compare->callback([arguments] {
    auto& names = arguments->options.executors;
    if (names.empty() || names == std::vector<std::string>{"paper"}) names = paper_executor_names();
    if (names == std::vector<std::string>{"all"}) names = all_executor_names();
    run_experiment(arguments->options);
  });
}

}  // namespace hotpath
