// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <istream>
#include <ostream>

#include "hotpath/analysis/sag_job.hpp"

namespace hotpath {

namespace {

constexpr std::array<std::string_view, 8> kColumns = {"Task ID",  "Job ID",   "Arrival min", "Arrival max",
                                                      "Cost min", "Cost max", "Deadline",    "Priority"};
constexpr std::string_view kHeader =
    "Task ID, Job ID, Arrival min, Arrival max, Cost min, Cost max, Deadline, Priority";

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

SagJob parse_row(std::string_view line, const std::string& where) {
  std::array<std::int64_t, 8> value{};
  std::size_t column = 0;
  for (;; ++column) {
    const auto comma = line.find(',');
    const std::string_view field = trim(line.substr(0, comma));
    if (column == value.size())
      throw AnalysisError(where + "more than 8 columns; expected " + std::string(kHeader));
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value[column]);
    if (error != std::errc{} || end != field.data() + field.size()) {
      throw AnalysisError(where + "'" + std::string(field) + "' in column '" + std::string(kColumns[column]) +
                          "' is no 64-bit integer");
    }
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  if (column + 1 != value.size()) {
    throw AnalysisError(where + std::to_string(column + 1) + " columns instead of 8; expected " +
                        std::string(kHeader));
  }
  if (value[0] < 0 || value[1] < 0) throw AnalysisError(where + "task and job numbers must not be negative");
  if (value[2] < 0 || value[2] > value[3]) {
    throw AnalysisError(where + "arrival times must satisfy 0 <= Arrival min <= Arrival max");
  }
  if (value[4] < 0 || value[4] > value[5]) {
    throw AnalysisError(where + "costs must satisfy 0 <= Cost min <= Cost max");
  }
  return {static_cast<std::uint64_t>(value[0]),
          static_cast<std::uint64_t>(value[1]),
          value[2],
          value[3],
          value[4],
          value[5],
          value[6],
          value[7]};
}

}  // namespace

void write_sag_csv(std::ostream& out, const std::vector<SagJob>& jobs) {
  out << kHeader << '\n';
  for (const SagJob& j : jobs) {
    out << j.task << ", " << j.job << ", " << j.arrival_min << ", " << j.arrival_max << ", " << j.cost_min
        << ", " << j.cost_max << ", " << j.deadline << ", " << j.priority << '\n';
  }
}

std::vector<SagJob> read_sag_csv(std::istream& in, const std::string& file_name) {
  std::vector<SagJob> jobs;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (trim(line).empty()) continue;
    // The tools skip the first line; so may a file without a header begin with a job.
    if (number == 1 && line.find("Task ID") != std::string::npos) continue;
    jobs.push_back(parse_row(line, file_name + ":" + std::to_string(number) + ": "));
  }
  if (jobs.empty()) throw AnalysisError(file_name + ": no jobs; expected lines of " + std::string(kHeader));
  return jobs;
}

}  // namespace hotpath
