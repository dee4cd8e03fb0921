// SPDX-License-Identifier: Apache-2.0
#include "commands/sweep_cells.hpp"

#include <algorithm>
#include <sstream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/core/input_error.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "results/stored_summary.hpp"
#include "sweep/rows.hpp"

namespace hotpath::commands {

namespace {

namespace fs = std::filesystem;

/// The reason why a cell has no result; the table has a row for it.
struct CellFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The option of a key in a sweep's file: `platform.KEY` is one key of --platform.
std::string option_of(const std::string& key) { return plural("--" + key.substr(0, key.find('.'))); }

std::string value_of(const sweep::Option& option) {
  const std::size_t dot = option.name.find('.');
  return dot == std::string::npos ? option.value : option.name.substr(dot + 1) + "=" + option.value;
}

/// The options of one call of a command. `table` has a row for each, which checks a text and sets the
/// member of the options.
struct CellOptions {
  explicit CellOptions(const std::string& command) {
    if (command == "simulate") add_simulate_options(table, simulate);
    if (command == "run") add_run_options(table, run);
    if (command == "analyze") add_analyze_options(table, analyze);
  }
  CellOptions(const std::string& command, const std::vector<sweep::Option>& options) : CellOptions(command) {
    set(options);
    simulate.executors = executors_of(simulate);
    simulate.threads = 1;
  }

  /// Throws CLI::ParseError.
  void set(const std::vector<sweep::Option>& options) {
    for (const sweep::Option& option : options)
      table.get_option(option_of(option.name))->add_result(value_of(option));
    const std::vector<CLI::Option*> all = table.get_options();
    for (CLI::Option* option : all) {
      if (option->count() > 0) option->run_callback();
    }
    for (const CLI::Option* option : all) check_others(*option);
  }

  CLI::App table;
  simulated::Options simulate;
  RunOptions run;
  guarantees::AnalyzeOptions analyze;

 private:
  static void check_others(const CLI::Option& option) {
    if (option.count() == 0) {
      if (option.get_required()) throw CLI::RequiredError(option.get_name());
      return;
    }
    for (const CLI::Option* needed : option.get_needs()) {
      if (needed->count() == 0) throw CLI::RequiresError(option.get_name(), needed->get_name());
    }
    for (const CLI::Option* excluded : option.get_excludes()) {
      if (excluded->count() > 0) throw CLI::ExcludesError(option.get_name(), excluded->get_name());
    }
  }
};

}  // namespace

SweepCells::SweepCells(sweep::Design design, fs::path output)
    : design_(std::move(design)), output_(std::move(output)) {
  const CellOptions known(design_.command);
  const auto check_name = [&](const std::string& name, int line) {
    const bool one_key = name.find('.') == std::string::npos || name.starts_with("platform.");
    if (one_key && known.table.get_option_no_throw(option_of(name)) != nullptr) return;
    std::vector<std::string> names;
    for (const CLI::Option* option : known.table.get_options()) {
      for (const std::string& long_name : option->get_lnames()) names.push_back(long_name);
    }
    throw InputError(design_.file, line, "`" + design_.command + "` has no option --" + name,
                     "it has " + program::joined(names));
  };
  for (const sweep::Option& option : design_.fixed) check_name(option.name, option.line);
  for (const sweep::Axis& axis : design_.axes) {
    check_name(axis.name, axis.line);
    for (const std::string& value : axis.examples()) {
      std::vector<sweep::Option> at = design_.coordinates(0);
      std::ranges::find(at, axis.name, &sweep::Option::name)->value = value;
      check_cell(at, axis.line);
    }
  }
}

void SweepCells::check_cell(const std::vector<sweep::Option>& at, int line) const {
  try {
    const CellOptions options(design_.command, options_of(at, 0));
    if (design_.command == "simulate") simulated::check_simulation(options.simulate);
  } catch (const CLI::ParseError& error) {
    throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
  } catch (const program::UsageError& error) {
    throw InputError(design_.file, line, error.what(), "correct this value, or the fixed options");
  }
}

std::vector<sweep::Option> SweepCells::options_of(const std::vector<sweep::Option>& at,
                                                  std::uint64_t cell) const {
  std::vector<sweep::Option> options = design_.fixed;
  const bool first = design_.repetition(cell) == 0;
  bool seeded = design_.command == "analyze";
  for (const sweep::Option& option : at) {
    if (option.name == "seed" && !first) continue;
    options.push_back(option);
    seeded = seeded || option.name == "seed";
  }
  if (!seeded) options.push_back({"seed", std::to_string(design_.seed_of(cell))});
  return options;
}

std::vector<std::string> SweepCells::result_columns() const {
  return design_.command == "analyze" ? program::table_of(guarantees::bound_columns(), {}).header
                                      : program::table_of(sweep::measured_columns(), {}).header;
}

std::vector<std::string> SweepCells::columns() const {
  std::vector<std::string> names = {"cell"};
  for (const sweep::Axis& axis : design_.axes) {
    if (sweep::has_column(axis.name)) names.push_back(axis.name);
  }
  names.insert(names.end(), {"repetition", "seed", "failure"});
  const std::vector<std::string> results = result_columns();
  names.insert(names.end(), results.begin(), results.end());
  return names;
}

std::string SweepCells::rows_of(std::uint64_t cell) const {
  std::string failure;
  std::vector<Row> rows = results_of(cell, failure);
  Row place = {cell};
  for (const sweep::Option& option : design_.coordinates(cell)) {
    if (sweep::has_column(option.name)) place.emplace_back(option.value);
  }
  place.insert(place.end(), {std::uint64_t{design_.repetition(cell)}, design_.seed_of(cell), failure});
  for (Row& row : rows) row.insert(row.begin(), place.begin(), place.end());
  return program::csv_of(rows);
}

std::vector<SweepCells::Row> SweepCells::results_of(std::uint64_t cell, std::string& failure) const {
  try {
    return design_.command == "analyze" ? bounds_of(cell) : measured_of(cell);
  } catch (const program::OverloadError& error) {
    failure = error.what();
  } catch (const CellFailure& error) {
    failure = error.what();
  } catch (const program::UsageError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", named(cell), ": ", error.what()));
  } catch (const InputError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", named(cell), ": ", error.what()));
  }
  return {failed(cell)};
}

std::string SweepCells::named(std::uint64_t cell) const {
  std::string name = program::concat("cell ", cell);
  for (const sweep::Option& option : design_.coordinates(cell))
    name += program::concat(", ", option.name, " ", option.value);
  return name;
}

SweepCells::Row SweepCells::failed(std::uint64_t cell) const {
  // The interrupt also ended the cell's process.
  if (program::interrupted() != 0) throw program::RunError("interrupted; the same command resumes the sweep");
  Row row(result_columns().size());
  for (const sweep::Option& option : design_.coordinates(cell)) {
    if (sweep::names_executor(option.name)) row.front() = option.value;
  }
  return row;
}

std::vector<SweepCells::Row> SweepCells::measured_of(std::uint64_t cell) const {
  results::Summary summary;
  if (live() || design_.keep) {
    const fs::path folder = output_ / "cells" / std::to_string(cell);
    run_as_child(cell, folder);
    const results::StoredRun run(folder, "a run");
    summary = results::summarize(run, run.summary_options());
    if (!design_.keep) fs::remove_all(folder);
  } else {
    const CellOptions options(design_.command, options_of(design_.coordinates(cell), cell));
    summary = simulated::summary_of_simulation(options.simulate);
  }
  return program::table_of(sweep::measured_columns(), sweep::measured_rows(summary)).rows;
}

std::vector<SweepCells::Row> SweepCells::bounds_of(std::uint64_t cell) const {
  const CellOptions options(design_.command, options_of(design_.coordinates(cell), cell));
  std::ostringstream printed;
  std::vector<guarantees::BoundRow> bounds;
  try {
    bounds = guarantees::analyze(options.analyze, printed);
  } catch (const program::RunError& error) {
    throw CellFailure(error.what());
  }
  if (bounds.empty()) throw CellFailure("no bound is known");
  return program::table_of(guarantees::bound_columns(), bounds).rows;
}

void SweepCells::run_as_child(std::uint64_t cell, const fs::path& folder) const {
  const std::vector<sweep::Option> options = options_of(design_.coordinates(cell), cell);
  const bool simulated = design_.command == "simulate";
  if (simulated) simulated::check_simulation(CellOptions(design_.command, options).simulate);
  std::vector<std::string> words = {design_.command};
  for (const sweep::Option& option : options)
    words.push_back(option_of(option.name) + "=" + value_of(option));
  words.push_back("--output=" + folder.string());
  fs::remove_all(folder);  // left by an earlier attempt
  try {
    program::run_hotpath(words);
  } catch (const program::RunError& error) {
    throw CellFailure(error.what());
  } catch (const program::UsageError& error) {
    if (!simulated) throw;
    throw CellFailure(error.what());  // an overload: check_simulation() found no other error
  }
}

}  // namespace hotpath::commands
