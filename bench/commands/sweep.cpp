// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <sstream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/analysis/parallel.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_summary.hpp"
#include "sweep/journal.hpp"
#include "sweep/rows.hpp"

namespace hotpath::commands {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A longer or larger sweep starts only with --yes.
constexpr double kLongest_s = 3600, kLargest_bytes = 1e9;
/// Cells timed before the others, spread over the design, to estimate duration and size.
constexpr std::size_t kTimed = 4;

/// What --new writes.
constexpr const char* kExampleSweep =
    R"(# A sweep: `command` runs for all combinations of the values of `axes`. docs/sweeps.md has all keys.
# Start or resume it:  hotpath sweep FILE
command: simulate  # Or analyze, or run, which measures live.
# Options of the command without dashes, in all cells alike.
fixed: {graph: autoware, duration: 10, warm-up: 1, phases: random}
axes:
  load: {from: 20, to: 100, step: 20}
  executors: [default, rm-ro]
  # set.FrontLidarDriver.period_ms: [50, 100]
  # platform.release_cost_us: [0, 10]
repetitions: 5  # Of each combination; their random numbers follow from the seed.
seed: 1
keep: none  # Or all: the run folders of all cells.
)";

struct SweepArguments {
  std::string file, output, new_file;
  unsigned threads = 0;
  bool yes = false;
};

std::string duration_text(double s) {
  if (s < 120) return program::text("%.0f s", s);
  return s < 7200 ? program::text("%.0f min", s / 60) : program::text("%.1f h", s / 3600);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// The option of a key in a sweep's file: `platform.KEY` is one key of --platform, and `set.NODE.KEY` one of
/// --set.
std::string option_of(const std::string& key) { return plural("--" + key.substr(0, key.find('.'))); }

std::string value_of(const sweep::Option& option) {
  const std::size_t dot = option.name.find('.');
  return dot == std::string::npos ? option.value : option.name.substr(dot + 1) + "=" + option.value;
}

/// One call of the sweep's command.
struct Call {
  explicit Call(const std::string& command) : table("", command) {
    if (command == "simulate") add_simulate_options(table, simulate);
    if (command == "run") add_run_options(table, run);
    if (command == "analyze") add_analyze_options(table, analyze);
  }
  /// Throws CLI::ParseError.
  Call(const std::string& command, std::vector<std::string> words) : Call(command) {
    std::ranges::reverse(words);  // as CLI11 wants them
    table.parse(std::move(words));
    simulate.executors = executors_of(simulate);
    simulate.threads = 1;
  }

  CLI::App table;
  simulated::Options simulate;
  RunOptions run;
  guarantees::AnalyzeOptions analyze;
};

/// The cells of a sweep. Each cell is one call of the sweep's command and yields rows of the table.
class SweepCells {
 public:
  /// Run folders are kept below `output`. Throws InputError, with its line, for an option that the
  /// command rejects.
  SweepCells(sweep::Design design, fs::path output) : design_(std::move(design)), output_(std::move(output)) {
    for (const sweep::Option& option : design_.fixed) check_name(option.name, option.line);
    for (const sweep::Axis& axis : design_.axes) {
      check_name(axis.name, axis.line);
      for (std::size_t i = 0; i < axis.size(); ++i) {
        if (!axis.is_checked(i)) continue;
        std::vector<sweep::Option> at = design_.coordinates(0);
        std::ranges::find(at, axis.name, &sweep::Option::name)->value = axis.value(i);
        check_cell(at, axis.line);
      }
    }
  }

  const sweep::Design& design() const { return design_; }
  bool live() const { return design_.command == "run"; }

  std::vector<std::string> columns() const { return with_place(0, "", no_results()).header; }

  /// The rows of one cell, as JSON. A cell that overloads the system or fails has one row with the
  /// reason. Throws UsageError if the command rejects its options, RunError after Ctrl-C.
  std::string rows_of(std::uint64_t cell) const {
    std::string place = program::concat(design_.file, ": cell ", cell), executor, failure;
    for (const sweep::Option& option : design_.coordinates(cell)) {
      place += program::concat(", ", option.name, " ", option.value);
      if (sweep::names_executor(option.name)) executor = option.value;
    }
    program::Table results = no_results();
    try {
      results = design_.command == "analyze" ? bounds_of(cell) : measured_of(cell);
    } catch (const program::OverloadError& error) {
      failure = error.what();
    } catch (const program::RunError& error) {
      if (design_.command == "simulate") throw;
      failure = error.what();
    } catch (const program::UsageError& error) {
      throw program::UsageError(place + ": " + error.what());
    } catch (const InputError& error) {
      throw program::UsageError(place + ": " + error.what());
    }
    // The interrupt also ended the cell's process.
    if (results.rows.empty() && program::interrupted() != 0)
      throw program::RunError("interrupted; the same command resumes the sweep");
    if (results.rows.empty()) results.rows.emplace_back(results.header.size()).front() = executor;
    return columns_and_rows(with_place(cell, failure, results))["rows"].dump();
  }

 private:
  program::Table no_results() const {
    return design_.command == "analyze" ? program::table_of(guarantees::bound_columns(), {})
                                        : sweep::measured_table({});
  }

  /// The rows after the cell's coordinates, without executor or deployment, which have a column of their own
  /// among the results, and the reason of a failure.
  program::Table with_place(std::uint64_t cell, const std::string& failure, program::Table results) const {
    std::vector<std::string> names = {"cell"};
    std::vector<program::Value> place = {cell};
    for (const sweep::Option& option : design_.coordinates(cell)) {
      if (sweep::names_executor(option.name)) continue;
      names.push_back(option.name);
      place.emplace_back(option.value);
    }
    names.insert(names.end(), {"repetition", "seed", "failure"});
    place.insert(place.end(), {design_.repetition(cell), design_.seed_of(cell), failure});
    results.header.insert(results.header.begin(), names.begin(), names.end());
    for (std::vector<program::Value>& row : results.rows) row.insert(row.begin(), place.begin(), place.end());
    return results;
  }

  void check_name(const std::string& name, int line) const {
    const Call known(design_.command);
    const bool one_key =
        name.find('.') == std::string::npos || name.starts_with("platform.") || name.starts_with("set.");
    if (one_key && known.table.get_option_no_throw(option_of(name)) != nullptr) return;
    std::vector<std::string> names;
    for (const CLI::Option* option : known.table.get_options()) {
      for (const std::string& long_name : option->get_lnames()) names.push_back(long_name);
    }
    throw InputError(design_.file, line, "`" + design_.command + "` has no option --" + name,
                     suggest(name, names));
  }

  void check_cell(const std::vector<sweep::Option>& at, int line) const {
    try {
      const Call call(design_.command, words_of(at, 0));
      if (design_.command == "simulate") simulated::check_simulation(call.simulate);
    } catch (const CLI::ParseError& error) {
      throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
    } catch (const program::UsageError& error) {
      throw InputError(design_.file, line, error.what(), "correct this value, or the fixed options");
    }
  }

  /// The command's words for a cell with these coordinates.
  std::vector<std::string> words_of(const std::vector<sweep::Option>& at, std::uint64_t cell) const {
    std::vector<std::string> words;
    for (const std::vector<sweep::Option>& options : {design_.fixed, at}) {
      for (const sweep::Option& o : options)
        words.push_back(program::concat(option_of(o.name), "=", value_of(o)));
    }
    if (design_.command != "analyze") words.push_back(program::concat("--seed=", design_.seed_of(cell)));
    return words;
  }

  program::Table measured_of(std::uint64_t cell) const {
    std::vector<std::string> words = words_of(design_.coordinates(cell), cell);
    if (!live() && !design_.keep)
      return sweep::measured_table(simulated::summary_of_simulation(Call(design_.command, words).simulate));
    const fs::path folder = output_ / "cells" / std::to_string(cell);
    fs::remove_all(folder);  // left by an earlier attempt
    words.push_back("--output=" + folder.string());
    if (live()) {
      words.insert(words.begin(), design_.command);
      program::run_hotpath(words);
    } else {
      simulated::store_simulation(Call(design_.command, words).simulate);
    }
    const results::StoredRun run(folder, "a run");
    const results::Summary summary = results::summarize(run, run.summary_options());
    if (!design_.keep) fs::remove_all(folder);
    return sweep::measured_table(summary);
  }

  program::Table bounds_of(std::uint64_t cell) const {
    const Call call(design_.command, words_of(design_.coordinates(cell), cell));
    std::ostringstream printed;
    const std::vector<guarantees::BoundRow> bounds = guarantees::analyze(call.analyze, printed);
    if (bounds.empty()) throw program::RunError("no bound is known");
    return program::table_of(guarantees::bound_columns(), bounds);
  }

  sweep::Design design_;
  fs::path output_;
};

class Sweep {
 public:
  explicit Sweep(const SweepArguments& arguments)
      : arguments_(arguments),
        folder_(arguments.output.empty() ? "runs/sweep-" + fs::path(arguments.file).stem().string()
                                         : arguments.output),
        cells_(sweep::load_sweep(arguments.file), folder_) {
    if (cells_.live() && arguments.threads > 1)
      throw program::UsageError("--threads: live cells run one at a time; leave it out");
  }

  void run() {
    sweep::Journal journal(folder_, design_);
    for (const std::string& note : journal.notes()) std::cerr << "note: " << note << "\n";
    prepare(journal);
    const std::vector<std::uint64_t> cells = journal.missing();
    begin_ = Clock::now();
    std::mutex adding;
    program::catch_interrupts();
    try {
      for_each_index(cells.size(), threads_, [&](std::size_t i) {
        if (program::interrupted() != 0) return;
        const std::string rows = cells_.rows_of(cells[i]);
        const std::lock_guard lock(adding);
        journal.add(cells[i], rows);
        show_progress(++added_, cells.size());
      });
    } catch (...) {
      journal.flush();
      throw;
    }
    if (isatty(STDERR_FILENO) != 0) program::replace_terminal_line("");
    journal.flush();
    finish(journal);
  }

 private:
  /// Prints the estimated duration and size of the sweep, from a few of its cells.
  void prepare(sweep::Journal& journal) const {
    const std::vector<std::uint64_t> missing = journal.missing();
    if (journal.done() > 0)
      std::cout << journal.done() << " of " << design_.cells() << " cells are in " << folder_ << " already\n";
    if (missing.empty()) return;
    const std::size_t timed = cells_.live() ? 1 : std::min(kTimed, missing.size());
    double bytes = 0;
    const auto begin = Clock::now();
    for (std::size_t i = 0; i < timed; ++i) {
      const std::uint64_t cell = missing[i * (missing.size() - 1) / std::max<std::size_t>(timed - 1, 1)];
      const std::string rows = cells_.rows_of(cell);
      bytes += static_cast<double>(rows.size());
      journal.add(cell, rows);
    }
    journal.flush();
    const double each = seconds_since(begin) / static_cast<double>(timed);
    const auto left = static_cast<double>(missing.size() - timed);
    const double took = left * each / threads_;
    const double size =
        bytes / static_cast<double>(timed) * static_cast<double>(design_.cells()) * 2;  // journal and table
    std::cout << program::text("%.0f of %llu cells of `%s` to do, about %s on %u thread(s); about %.1f MB",
                               left, static_cast<unsigned long long>(design_.cells()),
                               design_.command.c_str(), duration_text(took).c_str(), threads_, size / 1e6)
              << (design_.keep ? " plus the kept folders\n" : "\n") << std::flush;
    if (arguments_.yes || (took < kLongest_s && size < kLargest_bytes)) return;
    throw program::UsageError(
        "the sweep takes more than 1 hour or 1 GB; add --yes to start it (it can be interrupted and "
        "resumed), or make the design smaller");
  }

  void show_progress(std::size_t done, std::size_t all) {
    if (isatty(STDERR_FILENO) == 0 || Clock::now() - shown_ < std::chrono::milliseconds(300)) return;
    shown_ = Clock::now();
    const double left = seconds_since(begin_) * (static_cast<double>(all) / static_cast<double>(done) - 1);
    program::replace_terminal_line(
        program::concat(done, " of ", all, " cells, ", duration_text(left), " left"));
  }

  void finish(sweep::Journal& journal) const {
    if (!journal.missing().empty()) {
      std::cerr << program::concat("interrupted: ", journal.done(), " of ", design_.cells(), " cells are in ",
                                   folder_, "; the same command resumes the sweep\n");
      return;
    }
    journal.write_table(cells_.columns());
    std::cout << "Table: " << (fs::path(folder_) / "table.csv").string() << "\n";
    if (design_.command != "analyze") program::draw_figure("sweep", folder_);
  }

  const SweepArguments arguments_;
  const std::string folder_;
  const SweepCells cells_;
  const sweep::Design& design_ = cells_.design();
  const unsigned threads_ = cells_.live() ? 1 : thread_count(arguments_.threads);
  Clock::time_point begin_, shown_;
  std::size_t added_ = 0;
};

}  // namespace

const Command kSweep("Predict", 60, [](CLI::App& app) {
  auto [sweep, o] = add_command<SweepArguments>(
      app, "sweep", "Run a parameter sweep of runs or simulations and collect one table",
      "hotpath sweep autoware_load.yaml", [](const SweepArguments& arguments) {
        if (!arguments.new_file.empty()) return write_example(arguments.new_file, kExampleSweep, "sweep");
        if (arguments.file.empty()) throw CLI::RequiredError("FILE");
        Sweep(arguments).run();
      });
  add(sweep, "FILE", o.file, "", "Sweep file: fixed and varied options (docs/sweeps.md)");
  add(sweep, "--new", o.new_file, "FILE", "Write a commented example of a sweep into this new file");
  add(sweep, "--output", o.output, "FOLDER",
      "Folder for the table; resumes an unfinished sweep in it. By default runs/sweep-FILE");
  add(sweep, "--threads", o.threads, {0, 1024}, "N",
      "Parallel cells, 0 for one per CPU; live cells run one at a time");
  add(sweep, "--yes", o.yes, "Start even if the sweep takes more than 1 hour or 1 GB");
  sweep.get_option("--new")->excludes("FILE", "--output", "--threads", "--yes");
});

}  // namespace hotpath::commands
