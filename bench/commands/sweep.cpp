// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <sstream>

#include "commands/command.hpp"
#include "guarantees/analyze.hpp"
#include "hotpath/analysis/parallel.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"
#include "program/child_process.hpp"
#include "program/shown_text.hpp"
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
  if (s < 120) return text("%.0f s", s);
  return s < 7200 ? text("%.0f min", s / 60) : text("%.1f h", s / 3600);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// The option of a key in a sweep's file.
std::string option_of(const std::string& key) { return "--" + key.substr(0, key.find('.')); }

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
    for (const sweep::Axis& axis : design_.axes) check_name(axis.name, axis.line);
    for (const sweep::Axis& axis : design_.axes) {
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
    std::string place = concat(design_.file, ": cell ", cell), executor, failure;
    for (const sweep::Option& option : design_.coordinates(cell)) {
      place += concat(", ", option.name, " ", option.value);
      if (sweep::names_executor(option.name)) executor = option.value;
    }
    Table results = no_results();
    try {
      results = design_.command == "analyze" ? bounds_of(cell) : measured_of(cell);
    } catch (const program::OverloadError& error) {
      failure = error.what();
    } catch (const RunError& error) {
      if (design_.command == "simulate") throw;
      failure = error.what();
    } catch (const UsageError& error) {
      throw UsageError(place + ": " + error.what());
    } catch (const InputError& error) {
      throw UsageError(place + ": " + error.what());
    }
    // The interrupt also ended the cell's process.
    if (results.rows.empty() && program::interrupted() != 0)
      throw RunError("interrupted; the same command resumes the sweep");
    if (results.rows.empty()) results.rows.emplace_back(results.header.size()).front() = executor;
    return columns_and_rows(with_place(cell, failure, results))["rows"].dump();
  }

 private:
  Table no_results() const {
    return design_.command == "analyze" ? program::table_of(guarantees::bound_columns(), {})
                                        : sweep::measured_table({});
  }

  /// The rows after the cell's coordinates, without executor or deployment, which have a column of their own
  /// among the results, and the reason of a failure.
  Table with_place(std::uint64_t cell, const std::string& failure, Table results) const {
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
    for (const CLI::Option* option : known.table.get_options())
      names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    throw InputError(design_.file, line, "`" + design_.command + "` has no option --" + name,
                     suggest(name, names));
  }

  void check_cell(const std::vector<sweep::Option>& at, int line) const {
    try {
      const Call call(design_.command, words_of(at, 0));
      if (design_.command == "simulate") simulated::check_simulation(call.simulate);
    } catch (const CLI::ParseError& error) {
      throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
    } catch (const UsageError& error) {
      throw InputError(design_.file, line, error.what(), "correct this value, or the fixed options");
    }
  }

  /// The command's words for a cell with these coordinates. A key `platform.KEY` is one of --platform, and
  /// `set.NODE.KEY` one of --set.
  std::vector<std::string> words_of(const std::vector<sweep::Option>& at, std::uint64_t cell) const {
    std::vector<std::string> words;
    for (const std::vector<sweep::Option>& options : {design_.fixed, at}) {
      for (const sweep::Option& o : options) {
        const std::size_t key = o.name.find('.') + 1;  // npos + 1 is 0
        words.push_back(concat(option_of(o.name), "=", key > 0 ? o.name.substr(key) + "=" : "", o.value));
      }
    }
    if (design_.command != "analyze") words.push_back(concat("--seed=", design_.seed_of(cell)));
    return words;
  }

  Table measured_of(std::uint64_t cell) const {
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

  Table bounds_of(std::uint64_t cell) const {
    const Call call(design_.command, words_of(design_.coordinates(cell), cell));
    std::ostringstream printed;
    const std::vector<guarantees::BoundRow> bounds = guarantees::analyze(call.analyze, printed);
    if (bounds.empty()) throw RunError("no bound is known");
    return program::table_of(guarantees::bound_columns(), bounds);
  }

  sweep::Design design_;
  fs::path output_;
};

/// Computes a few missing cells, and prints from them the estimated duration and size of the sweep. Throws
/// UsageError if it needs --yes.
void begin_sweep(const SweepCells& cells, sweep::Journal& journal, unsigned threads, bool yes) {
  const sweep::Design& design = cells.design();
  const std::vector<std::uint64_t> missing = journal.missing();
  if (journal.done() > 0)
    std::cout << journal.done() << " of " << design.cells() << " cells are in " << journal.folder().string()
              << " already\n";
  if (missing.empty()) return;
  const std::size_t timed = cells.live() ? 1 : std::min(kTimed, missing.size());
  double bytes = 0;
  const auto begin = Clock::now();
  for (std::size_t i = 0; i < timed; ++i) {
    const std::uint64_t cell = missing[i * (missing.size() - 1) / std::max<std::size_t>(timed - 1, 1)];
    const std::string rows = cells.rows_of(cell);
    bytes += static_cast<double>(rows.size());
    journal.add(cell, rows);
  }
  journal.flush();
  const auto left = static_cast<double>(missing.size() - timed), done = static_cast<double>(timed);
  const double took = left * seconds_since(begin) / done / threads;
  const double size = bytes / done * static_cast<double>(design.cells()) * 2;  // journal and table
  std::cout << text("%.0f of %llu cells of `%s` to do, about %s on %u thread(s); about %.1f MB%s\n", left,
                    static_cast<unsigned long long>(design.cells()), design.command.c_str(),
                    duration_text(took).c_str(), threads, size / 1e6,
                    design.keep ? " plus the kept folders" : "")
            << std::flush;
  if (!yes && (took >= kLongest_s || size >= kLargest_bytes))
    throw UsageError(
        "the sweep takes more than 1 hour or 1 GB; add --yes to start it (it can be interrupted and "
        "resumed), or make the design smaller");
}

/// Computes the missing cells until all are done or a signal arrives. Also after an error, the journal keeps
/// the cells that are done.
void compute_cells(const SweepCells& cells, sweep::Journal& journal, unsigned threads) {
  const std::vector<std::uint64_t> missing = journal.missing();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const Clock::time_point begin = Clock::now();
  Clock::time_point shown;
  std::size_t added = 0;
  std::mutex adding;
  program::catch_interrupts();
  try {
    for_each_index(missing.size(), threads, [&](std::size_t i) {
      if (program::interrupted() != 0) return;
      const std::string rows = cells.rows_of(missing[i]);
      const std::lock_guard lock(adding);
      journal.add(missing[i], rows);
      ++added;
      if (!terminal || Clock::now() - shown < std::chrono::milliseconds(300)) return;
      shown = Clock::now();
      const auto left = static_cast<double>(missing.size() - added) / static_cast<double>(added);
      program::replace_terminal_line(concat(added, " of ", missing.size(), " cells, ",
                                            duration_text(seconds_since(begin) * left), " left"));
    });
  } catch (...) {
    journal.flush();
    throw;
  }
  if (terminal) program::replace_terminal_line("");
  journal.flush();
}

void run_sweep(const SweepArguments& arguments) {
  if (!arguments.new_file.empty()) return write_example(arguments.new_file, kExampleSweep, "sweep");
  if (arguments.file.empty()) throw CLI::RequiredError("FILE");
  const std::string folder =
      arguments.output.empty() ? "runs/sweep-" + fs::path(arguments.file).stem().string() : arguments.output;
  const SweepCells cells(sweep::load_sweep(arguments.file), folder);
  const sweep::Design& design = cells.design();
  if (cells.live() && arguments.threads > 1)
    throw UsageError("--threads: live cells run one at a time; leave it out");
  const unsigned threads = cells.live() ? 1 : thread_count(arguments.threads);
  sweep::Journal journal(folder, design);
  for (const std::string& note : journal.notes()) std::cerr << "note: " << note << "\n";
  begin_sweep(cells, journal, threads, arguments.yes);
  compute_cells(cells, journal, threads);
  if (!journal.missing().empty()) {
    std::cerr << concat("interrupted: ", journal.done(), " of ", design.cells(), " cells are in ", folder,
                        "; the same command resumes the sweep\n");
    return;
  }
  journal.write_table(cells.columns());
  std::cout << "Table: " << (fs::path(folder) / "table.csv").string() << "\n";
  if (design.command != "analyze") program::draw_figure("sweep", folder);
}

}  // namespace

const Command kSweep("Predict", 60, [](CLI::App& app) {
  auto [sweep, o] = add_command<SweepArguments>(
      app, "sweep", "Run a parameter sweep of runs or simulations and collect one table",
      "hotpath sweep autoware_load.yaml", run_sweep);
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
