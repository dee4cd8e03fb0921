// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "commands/sweep_cells.hpp"
#include "hotpath/campaign/crew.hpp"
#include "hotpath/core/input_error.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"
#include "program/whole_file.hpp"
#include "sweep/journal.hpp"

namespace hotpath::commands {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A longer or larger sweep starts only with --yes.
constexpr double kLongest_s = 3600, kLargest_bytes = 1e9;
/// Cells timed before the others, spread over the design, to estimate duration and size.
constexpr std::size_t kTimed = 4;

struct SweepArguments {
  std::string file, output;
  unsigned threads = 0;
  bool yes = false;
};

std::string duration_text(double s) {
  if (s < 120) return program::text("%.0f s", s);
  return s < 7200 ? program::text("%.0f min", s / 60) : program::text("%.1f h", s / 3600);
}

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
    Crew crew(cells_.live() ? 1 : arguments_.threads);
    if (cells_.live() && crew.ranks_on_this_machine() > 1) {
      throw program::UsageError(
          "live cells need one machine per rank, but several ranks run on this machine; start one rank "
          "per machine");
    }
    std::optional<sweep::Journal> journal;
    Campaign campaign;
    campaign.name = program::concat(design_.text, folder_);
    campaign.work = [this](std::uint64_t cell) { return cells_.rows_of(cell); };
    campaign.stopped = [] { return program::interrupted() != 0; };
    if (crew.coordinates()) {
      journal.emplace(folder_, design_);
      for (const std::string& note : journal->notes()) std::cerr << "note: " << note << "\n";
      prepare(*journal, crew);
      campaign.cells = journal->missing();
      begin_ = Clock::now();
      campaign.gather = [&](std::uint64_t cell, const std::string& rows) {
        journal->add(cell, rows);
        show_progress(++gathered_, campaign.cells.size());
      };
    }
    program::catch_interrupts();
    try {
      crew.run(campaign);
    } catch (...) {
      if (journal) journal->flush();
      throw;
    }
    if (!crew.coordinates()) return;
    if (isatty(STDERR_FILENO) != 0) program::replace_terminal_line("");
    journal->flush();
    finish(*journal);
  }

 private:
  /// Prints the estimated duration and size of the sweep, from a few of its cells.
  void prepare(sweep::Journal& journal, const Crew& crew) {
    const std::vector<std::uint64_t> missing = journal.missing();
    if (journal.done() > 0) {
      std::cout << journal.done() << " of " << design_.cells() << " cells are in "
                << journal.folder().string() << " already\n";
    }
    if (missing.empty()) return;
    const std::size_t timed = cells_.live() ? 1 : std::min(kTimed, missing.size());
    std::size_t bytes = 0;
    const auto begin = Clock::now();
    for (std::size_t i = 0; i < timed; ++i) {
      const std::uint64_t cell = missing[i * (missing.size() - 1) / std::max<std::size_t>(timed - 1, 1)];
      const std::string rows = cells_.rows_of(cell);
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
    std::cout << program::text(
                     "%.0f cells of `%s` to do, about %s on %u rank(s) with %u thread(s) each; about %.1f MB",
                     left, design_.command.c_str(), duration_text(took).c_str(), crew.ranks(), crew.threads(),
                     size / 1e6)
              << (design_.keep ? " plus the kept folders\n" : "\n") << std::flush;
    if (arguments_.yes || (took < kLongest_s && size < kLargest_bytes)) return;
    throw program::UsageError(
        "the sweep takes more than 1 hour or 1 GB; add --yes to start it (it can be interrupted and "
        "resumed), or make the design smaller");
  }

  void show_progress(std::size_t done, std::size_t all) {
    if (isatty(STDERR_FILENO) == 0 || Clock::now() - shown_ < std::chrono::milliseconds(300)) return;
    shown_ = Clock::now();
    const double elapsed = std::chrono::duration<double>(shown_ - begin_).count();
    const double left = elapsed * (static_cast<double>(all) / static_cast<double>(done) - 1);
    program::replace_terminal_line(
        program::concat(done, " of ", all, " cells, ", duration_text(left), " left"));
  }

  void finish(sweep::Journal& journal) const {
    const std::size_t missing = journal.missing().size();
    if (missing > 0) {
      std::cerr << program::concat("interrupted: ", journal.done(), " of ", design_.cells(), " cells are in ",
                                   journal.folder().string(), "; the same command resumes the sweep\n");
      return;
    }
    journal.write_table(program::joined(cells_.columns(), ","));
    std::cout << "Table: " << (journal.folder() / "table.csv").string() << "\n";
    if (design_.command != "analyze") program::draw_figure("sweep", journal.folder());
  }

  const SweepArguments arguments_;
  const std::string folder_;
  const SweepCells cells_;
  const sweep::Design& design_ = cells_.design();
  Clock::time_point begin_, shown_;
  std::size_t gathered_ = 0;
};

}  // namespace

void add_sweep_command(CLI::App& app) {
  auto [sweep, o] = add_command<SweepArguments>(
      app, "sweep", "Run a parameter sweep of runs or simulations and collect one table",
      "hotpath sweep sweeps/autoware_load.yaml",
      [](const SweepArguments& arguments) { Sweep(arguments).run(); });
  sweep.add_option("FILE", o.file, "Sweep file: fixed and varied options (docs/sweeps.md)")
      ->type_name("")
      ->required();
  add_text(sweep, "--output", o.output, "FOLDER",
           "Folder for the table; resumes an unfinished sweep in it. By\ndefault runs/sweep-FILE");
  add_number(sweep, "--threads", o.threads, {0, 1024}, "N",
             "Parallel cells per rank, 0 for one per CPU; live cells run\none at a time");
  sweep.add_flag("--yes", o.yes, "Start even if the sweep takes more than 1 hour or 1 GB");
}

const Command kSweep("Predict", 60, add_sweep_command);

}  // namespace hotpath::commands
