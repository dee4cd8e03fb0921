// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdio>
#include <iostream>
#include <memory>
#include <sstream>

#include "commands/commands.hpp"
#include "hotpath/analysis/wcrt_table.hpp"
#include "machine/release_cost.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"

namespace hotpath {

namespace {

/// The table for one release cost.
struct WcrtTable {
  const char* title;
  const char* name;  ///< In the column `delta_of` of wcrt_table.csv.
  std::int64_t delta;
};

struct TaskRow {
  const char* task;
  std::optional<std::int64_t> WcrtColumn::*bound;
};
constexpr std::array kTasks = {TaskRow{"IMU", &WcrtColumn::imu}, TaskRow{"Camera", &WcrtColumn::camera},
                               TaskRow{"LiDAR", &WcrtColumn::lidar}};

void print(const WcrtTable& table) {
  const auto columns = wcrt_table(table.delta);
  std::vector<std::string> header = {"task"};
  for (const WcrtColumn& c : columns) header.push_back(std::to_string(c.utilisation_percent) + " %");
  TextTable rows(text("%s (delta = %.3f us, Delta = n * delta = %.4f ms)", table.title,
                      static_cast<double>(table.delta) / 1e3, static_cast<double>(7 * table.delta) / 1e6),
                 std::move(header));
  for (std::size_t i = 0; i < kTasks.size(); ++i) {
    std::vector<TextTable::Cell> cells = {kTasks[i].task};
    for (const WcrtColumn& c : columns) {
      const auto bound = c.*kTasks[i].bound;
      cells.push_back((bound ? fixed(static_cast<double>(*bound) / 1e6, 2) : "-") +
                      text(" (%6.2f)", c.printed_ms[i]));
    }
    rows.add_row(std::move(cells));
  }
  std::cout << rows << "\n";
}

void write_rows(std::ostream& out, const WcrtTable& table) {
  for (const WcrtColumn& column : wcrt_table(table.delta)) {
    for (std::size_t i = 0; i < kTasks.size(); ++i) {
      out << table.name << ',' << table.delta << ',' << column.utilisation_percent << ',' << kTasks[i].task
          << ',';
      if (const auto bound = column.*kTasks[i].bound) out << *bound;
      out << ',' << column.printed_ms[i] << '\n';
    }
  }
}

std::string release_cost_csv(const ReleaseCost& measured) {
  std::ostringstream csv;
  csv << "timers,passes,p50_ns,p99_ns,max_ns\n";
  for (const ReleaseCost::Pass& pass : measured.passes) {
    csv << pass.timers << ',' << pass.passes << ',' << pass.p50.count() << ',' << pass.p99.count() << ','
        << pass.max.count() << '\n';
  }
  return csv.str();
}

void run_wcrt_table(const std::string& output) {
  const ReleaseCost measured = measure_release_cost();
  const std::array tables = {
      WcrtTable{"With the paper's release cost", "paper", kPaperDelta},
      WcrtTable{"With this machine's, 99.9th percentile", "this machine (p99.9)", measured.p999.count()},
      WcrtTable{"With this machine's, maximum", "this machine (maximum)", measured.max.count()}};
  std::cout << "Analytical worst-case response times in ms of the RM events executor (printed values of "
               "Table I in parentheses)\n\n";
  for (const WcrtTable& table : tables) print(table);
  std::cout << "The printed table corresponds to delta = 0.119 ms (Delta = 0.833 ms), which the paper's text "
               "rounds to 0.12 ms.\n`-`: no bound within the deadline.\n";
  if (output.empty()) return;
  const std::filesystem::path folder = output;
  create_folder(folder);
  std::ostringstream csv;
  csv << "delta_of,delta_ns,utilisation_percent,task,bound_ns,printed_ms\n";
  for (const WcrtTable& table : tables) write_rows(csv, table);
  write_whole_file(folder / "wcrt_table.csv", csv.str());
  write_whole_file(folder / "release_cost.csv", release_cost_csv(measured));
}

}  // namespace

void add_wcrt_table_experiment(CLI::App& experiment) {
  auto output = std::make_shared<std::string>();
  CLI::App* table = experiment.add_subcommand("wcrt-table", "Table I: analytical worst-case response times");
  table->add_option("--output", *output, "Folder for the table and this machine's release cost as CSV")
      ->type_name("FOLDER");
  table->callback([output] { run_wcrt_table(*output); });
}

}  // namespace hotpath
