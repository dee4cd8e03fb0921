// SPDX-License-Identifier: Apache-2.0
#include "commands/sweep_cells.hpp"

#include <algorithm>
#include <sstream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "guarantees/analyze.hpp"
#include "hotpath/core/input_error.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "simulated/simulated_run.hpp"
#include "sweep/child_run.hpp"
#include "sweep/rows.hpp"

namespace hotpath::commands {

namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr const char* kBoundColumns =
    "executor,method,kind,name,bound_ns,observed_ns,tightness,violated,deadline_ns,response_ns,waiting_ns,"
    "dominated_by";

/// The reason why a cell has no result; the table has a row for it.
struct CellFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The option of a key in a sweep's file: `platform.KEY` is one key of --platform.
std::string option_of(const std::string& key) { return key.substr(0, key.find('.')); }

std::string option_word(const sweep::Option& option) {
  const std::size_t dot = option.name.find('.');
  const std::string key = dot == std::string::npos ? "" : option.name.substr(dot + 1) + "=";
  return plural("--" + option_of(option.name)) + "=" + key + option.value;
}

/// Parses the options of a command without running it.
class OptionParser {
 public:
  explicit OptionParser(std::string command) : app_("", "hotpath"), command_(std::move(command)) {
    add_simulate_command(app_, [this](const simulated::Options& options) { simulate_ = options; });
    add_run_command(app_, [](const live::Options&) {});
    add_analyze_command(app_, [this](const guarantees::AnalyzeOptions& options) { analyze_ = options; });
    app_.require_subcommand(1);
    sub_ = app_.get_subcommand(command_);
  }

  bool has(const std::string& option) const {
    return sub_->get_option_no_throw(plural("--" + option)) != nullptr;
  }
  std::string all() const {
    Words names;
    for (const CLI::Option* option : sub_->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back(name);
    }
    return program::joined(names);
  }
  /// Throws CLI::ParseError.
  void parse(const Words& words) {
    Words all = words;
    all.insert(all.begin(), command_);
    std::ranges::reverse(all);  // CLI11 expects the arguments in reverse order
    app_.parse(all);
  }
  /// The options of `simulate`, and of `analyze`, after parse().
  [[nodiscard]] const simulated::Options& simulate() const { return simulate_; }
  [[nodiscard]] const guarantees::AnalyzeOptions& analyze() const { return analyze_; }

 private:
  CLI::App app_;
  const std::string command_;
  CLI::App* sub_ = nullptr;
  simulated::Options simulate_;
  guarantees::AnalyzeOptions analyze_;
};

}  // namespace

SweepCells::SweepCells(sweep::Design design, fs::path output)
    : design_(std::move(design)), output_(std::move(output)) {
  OptionParser parser(design_.command);
  const auto check_name = [&](const std::string& name, int line) {
    const bool one_key = name.find('.') == std::string::npos || name.starts_with("platform.");
    if (one_key && parser.has(option_of(name))) return;
    throw InputError(design_.file, line, "`" + design_.command + "` has no option --" + name,
                     "it has " + parser.all());
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
    OptionParser parser(design_.command);
    parser.parse(words_of(at, 0));
    if (design_.command == "simulate") simulated::check_simulation(parser.simulate());
  } catch (const CLI::ParseError& error) {
    throw InputError(design_.file, line, error.what(), "see `hotpath " + design_.command + " --help`");
  } catch (const program::UsageError& error) {
    throw InputError(design_.file, line, error.what(), "correct this value, or the fixed options");
  }
}

Words SweepCells::words_of(const std::vector<sweep::Option>& at, std::uint64_t cell) const {
  Words words;
  const auto add = [&](const sweep::Option& option) { words.push_back(option_word(option)); };
  std::ranges::for_each(design_.fixed, add);
  const bool first = design_.repetition(cell) == 0;
  bool seeded = design_.command == "analyze";
  for (const sweep::Option& option : at) {
    if (option.name == "seed" && !first) continue;
    add(option);
    seeded = seeded || option.name == "seed";
  }
  if (!seeded) words.push_back(program::concat("--seed=", design_.seed_of(cell)));
  return words;
}

std::string SweepCells::place_of(std::uint64_t cell) const {
  std::string place = std::to_string(cell) + ",";
  for (const sweep::Option& option : design_.coordinates(cell)) {
    if (sweep::has_column(option.name)) place += program::csv_field(option.value) + ",";
  }
  return program::concat(place, design_.repetition(cell), ",", design_.seed_of(cell), ",");
}

std::string SweepCells::header() const {
  std::string columns = "cell,";
  for (const sweep::Axis& axis : design_.axes) {
    if (sweep::has_column(axis.name)) columns += axis.name + ",";
  }
  return columns + "repetition,seed,failure," +
         (design_.command == "analyze" ? kBoundColumns : sweep::kMeasuredColumns);
}

std::string SweepCells::rows_of(std::uint64_t cell) const {
  const std::string place = place_of(cell);
  try {
    if (design_.command == "analyze") return bounds_of(cell, place);
    return measured_of(cell, place);
  } catch (const program::OverloadError& error) {
    return failed(cell, place, error.what());
  } catch (const CellFailure& error) {
    return failed(cell, place, error.what());
  } catch (const program::UsageError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", named(cell), ": ", error.what()));
  } catch (const InputError& error) {
    throw program::UsageError(program::concat(design_.file, ": ", named(cell), ": ", error.what()));
  }
}

std::string SweepCells::named(std::uint64_t cell) const {
  std::string name = program::concat("cell ", cell);
  for (const sweep::Option& option : design_.coordinates(cell))
    name += program::concat(", ", option.name, " ", option.value);
  return name;
}

std::string SweepCells::failed(std::uint64_t cell, const std::string& place, const std::string& why) const {
  // The interrupt also ended the cell's process.
  if (program::interrupted() != 0) throw program::RunError("interrupted; the same command resumes the sweep");
  std::string executor;
  for (const sweep::Option& option : design_.coordinates(cell)) {
    if (sweep::names_executor(option.name)) executor = option.value;
  }
  const std::string columns = design_.command == "analyze" ? kBoundColumns : sweep::kMeasuredColumns;
  const auto empty_columns = static_cast<std::size_t>(std::ranges::count(columns, ','));
  return place + program::csv_field(why) + "," + program::csv_field(executor) +
         std::string(empty_columns, ',') + "\n";
}

fs::path SweepCells::folder_of(std::uint64_t cell) const { return output_ / "cells" / std::to_string(cell); }

std::string SweepCells::measured_of(std::uint64_t cell, const std::string& place) const {
  results::Summary summary;
  if (live() || design_.keeps(cell)) {
    const fs::path folder = folder_of(cell);
    run_as_child(cell, "--output=" + folder.string());
    summary = sweep::summary_of_folder(folder);
    if (!design_.keeps(cell)) fs::remove_all(folder);
  } else {
    OptionParser parser(design_.command);
    parser.parse(words_of(design_.coordinates(cell), cell));
    simulated::Options options = parser.simulate();
    options.threads = 1;
    summary = simulated::summary_of_simulation(options);
  }
  std::string rows;
  for (const sweep::MeasuredRow& row : sweep::measured_rows(summary))
    rows += place + "," + sweep::csv_of(row) + "\n";
  return rows;
}

std::string SweepCells::bounds_of(std::uint64_t cell, const std::string& place) const {
  OptionParser parser(design_.command);
  parser.parse(words_of(design_.coordinates(cell), cell));
  std::ostringstream printed;
  std::istringstream table;
  try {
    table.str(guarantees::analyze(parser.analyze(), printed));
  } catch (const program::RunError& error) {
    throw CellFailure(error.what());
  }
  std::string rows, line;
  for (std::getline(table, line); std::getline(table, line);)
    rows.append(place).append(",").append(line).append("\n");
  return rows.empty() ? failed(cell, place, "no bound is known") : rows;
}

void SweepCells::run_as_child(std::uint64_t cell, const std::string& results) const {
  Words words = words_of(design_.coordinates(cell), cell);
  const bool simulated = design_.command == "simulate";
  if (simulated) {
    OptionParser parser(design_.command);
    parser.parse(words);
    simulated::check_simulation(parser.simulate());
  }
  words.insert(words.begin(), design_.command);
  words.push_back(results);
  fs::remove_all(folder_of(cell));  // left by an earlier attempt
  try {
    sweep::run_hotpath(words);
  } catch (const program::RunError& error) {
    throw CellFailure(error.what());
  } catch (const program::UsageError& error) {
    if (!simulated) throw;
    throw CellFailure(error.what());  // an overload: check_simulation() found no other error
  }
}

}  // namespace hotpath::commands
