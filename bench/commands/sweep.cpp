// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/campaign/crew.hpp"
#include "hotpath/core/input_error.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "simulated/simulated_run.hpp"
#include "sweep/child_run.hpp"
#include "sweep/design.hpp"
#include "sweep/journal.hpp"
#include "sweep/rows.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Words = std::vector<std::string>;

/// Beyond either a sweep begins only with --yes.
constexpr double kLongest_s = 3600, kLargest_bytes = 1e9;
/// Cells that are timed before the others, spread over the design.
constexpr std::size_t kTimed = 4;

constexpr const char* kBoundColumns =
    "executor,method,kind,name,bound_ns,observed_ns,tightness,violated,deadline_ns,response_ns,waiting_ns,"
    "dominated_by";

struct SweepArguments {
  std::string file, output;
  unsigned threads = 0;
  double rank_time_out_s = 20;
  bool yes = false;
};

std::string option_word(const SweepOption& option) { return "--" + option.name + "=" + option.value; }

std::string duration_text(double s) {
  if (s < 120) return text("%.0f s", s);
  return s < 7200 ? text("%.0f min", s / 60) : text("%.1f h", s / 3600);
}

/// How a command takes options, without doing what it does.
class OptionParser {
 public:
  explicit OptionParser(std::string command) : app_("", "hotpath"), command_(std::move(command)) {
    add_simulate_command(app_, [this](const SimulateOptions& options) { simulate_ = options; });
    add_run_command(app_);
    add_analyze_command(app_);
    app_.require_subcommand(1);
    sub_ = app_.get_subcommand(command_);
    // The command's own callback keeps its options alive, and must not run.
    if (command_ != "simulate") sub_->parse_complete_callback([] { throw CLI::Success(); });
  }

  bool has(const std::string& option) const { return sub_->get_option_no_throw("--" + option) != nullptr; }
  std::string all() const {
    Words names;
    for (const CLI::Option* option : sub_->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back(name);
    }
    return joined(names);
  }
  /// Throws CLI::ParseError.
  const SimulateOptions& parse(const Words& words) {
    Words all = words;
    all.insert(all.begin(), command_);
    std::ranges::reverse(all);  // as CLI11 takes them
    try {
      app_.parse(all);
    } catch (const CLI::Success&) {
    }
    return simulate_;
  }

 private:
  CLI::App app_;
  const std::string command_;
  CLI::App* sub_ = nullptr;
  SimulateOptions simulate_;
};

class Sweep {
 public:
  explicit Sweep(const SweepArguments& arguments)
      : arguments_(arguments), design_(load_sweep(arguments.file)), live_(design_.command == "run") {
    if (arguments_.output.empty()) {
      arguments_.output = "runs/sweep-" + fs::path(arguments_.file).stem().string();
    }
    check();
  }

  void run() {
    const auto silence = std::chrono::milliseconds(std::llround(arguments_.rank_time_out_s * 1000));
    Crew crew({live_ ? 1 : arguments_.threads, silence});
    if (live_ && crew.ranks_on_this_machine() > 1) {
      throw UsageError(
          "live cells need a machine each, and several ranks run on this one; start one a machine");
    }
    std::optional<SweepJournal> journal;
    Campaign campaign;
    campaign.name = concat(design_.text, arguments_.output);
    campaign.work = [this](std::uint64_t cell) { return rows_of(cell); };
    campaign.stopped = [] { return interrupted() != 0; };
    if (crew.coordinates()) {
      journal.emplace(arguments_.output, design_);
      prepare(*journal, crew);
      campaign.cells = journal->missing();
      begin_ = Clock::now();
      campaign.gather = [&](std::uint64_t cell, const std::string& rows) {
        journal->add(cell, rows);
        show_progress(++gathered_, campaign.cells.size());
      };
    }
    catch_interrupts();
    std::vector<std::string> notes;
    try {
      notes = crew.run(campaign);
    } catch (...) {
      if (journal) journal->flush();
      throw;
    }
    if (!crew.coordinates()) return;
    if (isatty(STDERR_FILENO) != 0) std::cerr << "\r\033[K";
    for (const std::string& note : notes) std::cerr << "note: " << note << "\n";
    journal->flush();
    finish(*journal);
  }

 private:
  /// Refuses what is wrong with the options, with the line where they stand.
  void check() {
    OptionParser parser(design_.command);
    for (const SweepOption& option : design_.fixed) check_name(parser, option.name, option.line);
    for (const SweepAxis& axis : design_.axes) {
      check_name(parser, axis.name, axis.line);
      for (const std::string& value : tried_values(axis)) {
        std::vector<SweepOption> at = design_.coordinates(0);
        std::ranges::find(at, axis.name, &SweepOption::name)->value = value;
        check_cell(at, axis.line);
      }
    }
  }

  static Words tried_values(const SweepAxis& axis) {
    if (!axis.values.empty()) return axis.values;
    return {text("%.10g", axis.low), text("%.10g", axis.high)};
  }

  void check_name(const OptionParser& parser, const std::string& name, int line) const {
    if (parser.has(name) || (name == "graph" && design_.command == "analyze")) return;
    throw InputError(design_.file, line, "`" + design_.command + "` has no option --" + name,
                     "it has " + parser.all());
  }

  void check_cell(const std::vector<SweepOption>& at, int line) const {
    try {
      const SimulateOptions options = OptionParser(design_.command).parse(words_of(at, 0));
      if (design_.command == "simulate") check_simulation(options);
    } catch (const CLI::ParseError& error) {
      throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
    } catch (const UsageError& error) {
      throw InputError(design_.file, line, error.what(), "correct this value, or what is fixed");
    }
  }

  /// The command line of a cell with these coordinates, after the command.
  Words words_of(const std::vector<SweepOption>& at, std::uint64_t cell) const {
    Words words;
    const auto add = [&](const SweepOption& option) {
      const bool positional = option.name == "graph" && design_.command == "analyze";
      words.push_back(positional ? option.value : option_word(option));
    };
    std::ranges::for_each(design_.fixed, add);
    std::ranges::for_each(at, add);
    const bool seeded = std::ranges::find(at, "seed", &SweepOption::name) != at.end();
    if (!seeded && design_.command != "analyze") words.push_back(concat("--seed=", design_.seed_of(cell)));
    return words;
  }

  /// The columns of a cell, the same in each of its rows. What schedules the graph has a column anyway.
  std::string place_of(std::uint64_t cell) const {
    std::string place = std::to_string(cell) + ",";
    for (const SweepOption& option : design_.coordinates(cell)) {
      if (!names_executor(option.name)) place += csv_field(option.value) + ",";
    }
    return concat(place, design_.repetition(cell), ",", design_.seed_of(cell), ",");
  }

  std::string header() const {
    std::string columns = "cell,";
    for (const SweepAxis& axis : design_.axes) {
      if (!names_executor(axis.name)) columns += axis.name + ",";
    }
    return columns + "repetition,seed,failure," +
           (design_.command == "analyze" ? kBoundColumns : kMeasuredColumns);
  }

  /// The table's rows of one cell. What cannot be run has one row that says why.
  std::string rows_of(std::uint64_t cell) const {
    const std::string place = place_of(cell);
    try {
      if (design_.command == "analyze") return bounds_of(cell, place);
      return measured_of(cell, place);
    } catch (const UsageError& error) {
      return failed(cell, place, error.what());
    } catch (const InputError& error) {
      return failed(cell, place, error.what());
    }
  }

  std::string failed(std::uint64_t cell, const std::string& place, const std::string& why) const {
    if (interrupted() != 0) throw RunError("interrupted; the same command goes on");  // its process was, too
    std::string executor;
    for (const SweepOption& option : design_.coordinates(cell)) {
      if (names_executor(option.name)) executor = option.value;
    }
    const std::string columns = design_.command == "analyze" ? kBoundColumns : kMeasuredColumns;
    const auto more = static_cast<std::size_t>(std::ranges::count(columns, ','));
    return place + csv_field(why) + "," + csv_field(executor) + std::string(more, ',') + "\n";
  }

  fs::path folder_of(std::uint64_t cell) const {
    return fs::path(arguments_.output) / "cells" / std::to_string(cell);
  }

  std::string measured_of(std::uint64_t cell, const std::string& place) const {
    Summary summary;
    if (live_ || design_.keeps(cell)) {
      const fs::path folder = folder_of(cell);
      run_as_child(cell, "--output=" + folder.string());
      summary = summary_of_folder(folder);
      if (!design_.keeps(cell)) fs::remove_all(folder);
    } else {
      SimulateOptions options =
          OptionParser(design_.command).parse(words_of(design_.coordinates(cell), cell));
      options.threads = 1;
      summary = summary_of_simulation(options);
    }
    std::string rows;
    for (const MeasuredRow& row : measured_rows(summary)) rows += place + "," + csv_of(row) + "\n";
    return rows;
  }

  std::string bounds_of(std::uint64_t cell, const std::string& place) const {
    const fs::path csv = fs::temp_directory_path() / text("hotpath-%d-%lu.csv", getpid(), cell);
    run_as_child(cell, "--csv=" + csv.string());
    std::ifstream in(csv);
    std::string rows, line;
    for (std::getline(in, line); std::getline(in, line);) rows += place + "," + line + "\n";
    fs::remove(csv);
    return rows.empty() ? failed(cell, place, "no bound is known") : rows;
  }

  /// Runs a cell in a process of its own, which leaves its results in files.
  void run_as_child(std::uint64_t cell, const std::string& results) const {
    Words words = words_of(design_.coordinates(cell), cell);
    words.insert(words.begin(), design_.command);
    words.push_back(results);
    fs::remove_all(folder_of(cell));  // of an earlier attempt
    run_hotpath(words);
  }

  /// Says how long and how large the sweep will be, from a few of its cells.
  void prepare(SweepJournal& journal, const Crew& crew) {
    const std::vector<std::uint64_t> missing = journal.missing();
    if (journal.done() > 0) {
      std::cout << journal.done() << " of " << design_.cells() << " cells are in "
                << journal.folder().string() << " already\n";
    }
    if (missing.empty()) return;
    const std::size_t timed = live_ ? 1 : std::min(kTimed, missing.size());
    std::size_t bytes = 0;
    const auto begin = Clock::now();
    for (std::size_t i = 0; i < timed; ++i) {
      const std::uint64_t cell = missing[i * (missing.size() - 1) / std::max<std::size_t>(timed - 1, 1)];
      const std::string rows = rows_of(cell);
      bytes += rows.size();
      journal.add(cell, rows);
    }
    journal.flush();
    const double each =
        std::chrono::duration<double>(Clock::now() - begin).count() / static_cast<double>(timed);
    const auto left = static_cast<double>(missing.size() - timed);
    const double took = left * each / (crew.ranks() * crew.threads());
    const double size = static_cast<double>(bytes) / static_cast<double>(timed) *
                        static_cast<double>(design_.cells()) * 2;  // journal and table
    std::cout << text(
                     "%.0f cells of `%s` to do, about %s on %u rank(s) with %u thread(s) each; about %.1f MB",
                     left, design_.command.c_str(), duration_text(took).c_str(), crew.ranks(), crew.threads(),
                     size / 1e6)
              << (design_.keep_all || !design_.keep.empty() ? " without the folders kept\n" : "\n")
              << std::flush;
    if (arguments_.yes || (took < kLongest_s && size < kLargest_bytes)) return;
    throw UsageError(
        "this is a long way; add --yes to go it (it can be interrupted and resumed), or make the "
        "design smaller");
  }

  void show_progress(std::size_t done, std::size_t all) {
    if (isatty(STDERR_FILENO) == 0 || Clock::now() - shown_ < std::chrono::milliseconds(300)) return;
    shown_ = Clock::now();
    const double elapsed = std::chrono::duration<double>(shown_ - begin_).count();
    const double left = elapsed * (static_cast<double>(all) / static_cast<double>(done) - 1);
    std::cerr << "\r\033[K" << done << " of " << all << " cells, " << duration_text(left) << " left"
              << std::flush;
  }

  void finish(SweepJournal& journal) const {
    const std::size_t missing = journal.missing().size();
    if (missing > 0) {
      std::cerr << concat("interrupted: ", journal.done(), " of ", design_.cells(), " cells are in ",
                          journal.folder().string(), "; the same command goes on with the others\n");
      return;
    }
    journal.write_table(header());
    std::cout << "Table: " << (journal.folder() / "table.csv").string() << "\n";
    if (design_.command != "analyze") draw_figure("sweep", journal.folder());
  }

  SweepArguments arguments_;
  const SweepDesign design_;
  const bool live_;
  Clock::time_point begin_, shown_;
  std::size_t gathered_ = 0;
};

}  // namespace

void add_sweep_command(CLI::App& app) {
  auto [sweep, o] = add_command<SweepArguments>(
      app, "sweep", "Thousands of runs or simulations from one file, into one table",
      "hotpath sweep sweeps/autoware_load.yaml",
      [](const SweepArguments& arguments) { Sweep(arguments).run(); });
  sweep.add_option("FILE", o.file, "What is fixed and what varies: docs/sweeps.md")->required();
  add_text(sweep, "--output", o.output, "FOLDER",
           "Folder for the table; an unfinished sweep in it goes on.\nBy default runs/sweep-FILE");
  add_number(sweep, "--threads", o.threads, {0, 1024}, "N",
             "Cells at the same time, of each rank; 0: one for each\nprocessor. Live cells run one by one");
  add_number(sweep, "--rank-time-out", o.rank_time_out_s, {0.1, 3600}, "SECONDS",
             "Others do the cells of a rank that is silent for so long");
  sweep.add_flag("--yes", o.yes, "Begin also what takes more than an hour or a gigabyte");
}

}  // namespace hotpath
