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

}  // namespace

SweepCells::SweepCells(sweep::Design design, fs::path output)
    : design_(std::move(design)), output_(std::move(output)) {
  const Call known(design_.command);
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
    for (std::size_t i = 0; i < axis.values.size(); ++i) {
      if (axis.range && i > 1 && i + 1 < axis.values.size()) continue;
      std::vector<sweep::Option> at = design_.coordinates(0);
      std::ranges::find(at, axis.name, &sweep::Option::name)->value = axis.values[i];
      check_cell(at, axis.line);
    }
  }
}

void SweepCells::check_cell(const std::vector<sweep::Option>& at, int line) const {
  try {
    const Call call(design_.command, words_of(at, 0));
    if (design_.command == "simulate") simulated::check_simulation(call.simulate);
  } catch (const CLI::ParseError& error) {
    throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
  } catch (const program::UsageError& error) {
    throw InputError(design_.file, line, error.what(), "correct this value, or the fixed options");
  }
}

std::vector<std::string> SweepCells::words_of(const std::vector<sweep::Option>& at,
                                              std::uint64_t cell) const {
  std::vector<sweep::Option> options = design_.fixed;
  options.insert(options.end(), at.begin(), at.end());
  if (design_.command != "analyze") options.push_back({"seed", std::to_string(design_.seed_of(cell))});
  std::vector<std::string> words(options.size());
  std::ranges::transform(options, words.begin(), [](const sweep::Option& option) {
    return program::concat(option_of(option.name), "=", value_of(option));
  });
  return words;
}

std::vector<std::string> SweepCells::columns() const {
  std::vector<std::string> names = {"cell"};
  for (const sweep::Axis& axis : design_.axes) {
    if (!sweep::names_executor(axis.name)) names.push_back(axis.name);
  }
  names.insert(names.end(), {"repetition", "seed", "failure"});
  const program::Table results = design_.command == "analyze"
                                     ? program::table_of(guarantees::bound_columns(), {})
                                     : program::table_of(sweep::measured_columns(), {});
  names.insert(names.end(), results.header.begin(), results.header.end());
  return names;
}

std::string SweepCells::rows_of(std::uint64_t cell) const {
  std::string name = program::concat("cell ", cell), executor, failure;
  Row place = {cell};
  for (const sweep::Option& option : design_.coordinates(cell)) {
    name += program::concat(", ", option.name, " ", option.value);
    if (sweep::names_executor(option.name)) {
      executor = option.value;
    } else {
      place.emplace_back(option.value);
    }
  }
  std::vector<Row> rows;
  try {
    rows = design_.command == "analyze" ? bounds_of(cell) : measured_of(cell);
  } catch (const program::OverloadError& error) {
    failure = error.what();
  } catch (const CellFailure& error) {
    failure = error.what();
  } catch (const program::UsageError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", name, ": ", error.what()));
  } catch (const InputError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", name, ": ", error.what()));
  }
  // The interrupt also ended the cell's process.
  if (rows.empty() && program::interrupted() != 0)
    throw program::RunError("interrupted; the same command resumes the sweep");
  place.insert(place.end(), {std::uint64_t{design_.repetition(cell)}, design_.seed_of(cell), failure});
  if (rows.empty()) {
    rows.emplace_back(columns().size() - place.size());
    rows.front().front() = executor;
  }
  for (Row& row : rows) row.insert(row.begin(), place.begin(), place.end());
  return program::csv_of(rows);
}

std::vector<SweepCells::Row> SweepCells::measured_of(std::uint64_t cell) const {
  std::vector<std::string> words = words_of(design_.coordinates(cell), cell);
  const auto rows_of = [](const results::Summary& summary) {
    return program::table_of(sweep::measured_columns(), sweep::measured_rows(summary)).rows;
  };
  if (!live() && !design_.keep)
    return rows_of(simulated::summary_of_simulation(Call(design_.command, words).simulate));
  const fs::path folder = output_ / "cells" / std::to_string(cell);
  fs::remove_all(folder);  // left by an earlier attempt
  words.push_back("--output=" + folder.string());
  if (live()) {
    words.insert(words.begin(), design_.command);
    try {
      program::run_hotpath(words);
    } catch (const program::RunError& error) {
      throw CellFailure(error.what());
    }
  } else {
    simulated::store_simulation(Call(design_.command, words).simulate);
  }
  const results::StoredRun run(folder, "a run");
  const results::Summary summary = results::summarize(run, run.summary_options());
  if (!design_.keep) fs::remove_all(folder);
  return rows_of(summary);
}

std::vector<SweepCells::Row> SweepCells::bounds_of(std::uint64_t cell) const {
  const Call call(design_.command, words_of(design_.coordinates(cell), cell));
  std::ostringstream printed;
  std::vector<guarantees::BoundRow> bounds;
  try {
    bounds = guarantees::analyze(call.analyze, printed);
  } catch (const program::RunError& error) {
    throw CellFailure(error.what());
  }
  if (bounds.empty()) throw CellFailure("no bound is known");
  return program::table_of(guarantees::bound_columns(), bounds).rows;
}

}  // namespace hotpath::commands
