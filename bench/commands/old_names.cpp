// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/text.hpp"

namespace hotpath::commands {

namespace {

/// A name of an earlier version: a command, or an option of any command or, after a blank, of one.
struct OldName {
  std::string_view name, now;
};

constexpr std::string_view kPlatform =
    "`--platform KEY=US` now, with the name's underscores, as in wake_up_us=5";
constexpr std::array kOldNames = {
    OldName{"machine", "`doctor` now"},
    OldName{"check", "`doctor RUN` now"},
    OldName{"recover", "`doctor RUN --recover` now"},
    OldName{"summarize", "`report RUN --summary` now"},
    OldName{"timeline", "gone: the page of `report RUN` has it; or `export perfetto RUN --from MS --to MS`"},
    OldName{"compare-results", "`diff OLD NEW` now"},
    OldName{"validate", "`diff RUN --simulated` now, and `paper golden` without a run"},
    OldName{"experiment", "`paper table1` and `paper waters` now"},
    OldName{"caret", "gone: record with LTTng, and `import ctf` the trace"},
    OldName{"completion", "gone: the package installs completions for bash"},
    OldName{"--phases-file", "`--phases FILE` now"},
    OldName{"--phases-of", "`--phases RUN` now"},
    OldName{"--phase-step", "`--phases creation:MS` now"},
    OldName{"--delta-us", "`--platform release_cost_us=US` now"},
    OldName{"--live-alternate", "gone: use --live in one of two runs, and `diff` them"},
    OldName{"--live-cpus", "gone: the publishing process runs where --cpus leaves processors free"},
    OldName{"--ros2-runner", "the variable HOTPATH_ROS2_RUNNER now"},
    OldName{"--coarse", "gone: a search begins with 12 levels"},
    OldName{"--rank-time-out", "gone: a dead rank ends the sweep, and the same command resumes it"},
    OldName{"--repeat-disturbed", "gone: disturbed repetitions are marked; measure with more --repetitions"},
    OldName{"--budget", "`--time-out` now"},
    OldName{"--draws", "`--repetitions` now"},
    OldName{"--rule", "a variant of an executor now, as in rm-ro:first"},
    OldName{"--ties", "a variant of an executor now, as in rm-ro:fifo"},
    OldName{"--cpu-time", "gone: work in CPU time (--work) records it"},
    OldName{"--dot", "`--as dot` now"},
    OldName{"--svg", "gone: draw `--as dot` with `dot -Tsvg`"},
    OldName{"--cie", "`--as cie` now"},
    OldName{"--perfetto", "`export perfetto RUN` now"},
    OldName{"--start", "`--from` now"},
    OldName{"--speed", "`--rate PERCENT` now, as in --rate 50 for half the speed"},
    OldName{"replay --live", "gone: replay always publishes"},
    OldName{"capacity --live", "gone: confirm a level with `run`, or `sweep` live cells"},
    OldName{"watch --record", "`--output FOLDER` now"},
    OldName{"diff --page", "`--output FOLDER` now"},
    OldName{"capacity --live-options", "gone: confirm a level with `run`, or `sweep` live cells"},
    OldName{"analyze --chain", "gone: give the graph file a chain"},
    OldName{"analyze --page", "gone: `--csv` has the bounds, and the page of `report RUN` marks them"},
    OldName{"figures --list", "`hotpath list figures` now"},
    OldName{"bench --compare", "gone: use `diff OLD NEW`, and compare.py of Google Benchmark for times"},
};

/// With the name that `word` begins, or else the nearest one.
std::string text_of(const char* kind, const std::string& word, const std::vector<std::string>& names) {
  const auto begun = std::ranges::find_if(
      names, [&](const std::string& name) { return word.size() > 2 && name.starts_with(word); });
  return program::concat("unknown ", kind, " `", word, "`",
                         did_you_mean(begun == names.end() ? word : *begun, names));
}

}  // namespace

std::string plural(const std::string& word) {
  for (const std::string one : {"--executor", "--deployment"}) {
    if (word == one || word.starts_with(one + "=")) return one + "s" + word.substr(one.size());
  }
  return word;
}

std::string what_became_of(const std::string& command, const std::string& word) {
  for (const OldName& old : kOldNames) {
    if (old.name == word || old.name == program::concat(command, " ", word))
      return program::concat("`", word, "` is ", old.now);
  }
  if (!word.starts_with("--")) return "";
  std::string key = word.substr(2);
  std::ranges::replace(key, '-', '_');
  if (key == "timer_thread" || std::ranges::count(kPlatformCosts, key, &PlatformCost::key) > 0)
    return program::concat("`", word, "` is ", kPlatform);
  return "";
}

std::string unknown_word(const CLI::App& app) {
  const CLI::App* command = &app;
  std::string path;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    path = command->get_name();
  }
  const std::vector<std::string> words = app.remaining(true);
  const bool wants_command = command->get_require_subcommand_min() > 0;
  const auto option =
      std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("--"); });
  if (!wants_command && option == words.end()) return "";
  std::vector<std::string> names;
  for (const CLI::App* sub : command->get_subcommands({})) {
    if (!sub->get_group().empty()) names.push_back(sub->get_name());
  }
  if (wants_command && words.empty()) return "a command is missing; available: " + program::joined(names);
  const std::string word = wants_command ? words.front() : option->substr(0, option->find('='));
  if (std::string now = what_became_of(path, word); !now.empty()) return now;
  if (wants_command && names.size() == 1 && did_you_mean(word, names).empty())  // it is the only command's
    return program::concat("unknown command `", word, "`; write `hotpath ", path, " ", names.front(), " ",
                           word, "`");
  if (wants_command) return text_of("command", word, names);
  for (const CLI::Option* known : command->get_options()) {
    for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
  }
  return text_of("option", word, names);
}

}  // namespace hotpath::commands
