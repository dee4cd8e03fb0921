// SPDX-License-Identifier: Apache-2.0
#include <istream>
#include <ostream>
#include <string>

#include "hotpath/analysis/sag_job.hpp"
#include "hotpath/core/csv.hpp"

namespace hotpath {

namespace {

const std::vector<std::string> kColumns = {"Task ID",  "Job ID",   "Arrival min", "Arrival max",
                                           "Cost min", "Cost max", "Deadline",    "Priority"};

SagJob read_job(const CsvReader& row) {
  const auto value = [&](std::size_t column) { return row.number<std::int64_t>(column); };
  if (value(2) < 0 || value(2) > value(3)) {
    row.fail("arrival times are out of order", "give 0 <= Arrival min <= Arrival max");
  }
  if (value(4) < 0 || value(4) > value(5)) {
    row.fail("costs are out of order", "give 0 <= Cost min <= Cost max");
  }
  return {row.number<std::uint64_t>(0),
          row.number<std::uint64_t>(1),
          value(2),
          value(3),
          value(4),
          value(5),
          value(6),
          value(7)};
}

}  // namespace

void write_sag_csv(std::ostream& out, const std::vector<SagJob>& jobs) {
  for (const std::string& column : kColumns) out << (&column == &kColumns.front() ? "" : ", ") << column;
  out << '\n';
  for (const SagJob& j : jobs) {
    out << j.task << ", " << j.job << ", " << j.arrival_min << ", " << j.arrival_max << ", " << j.cost_min
        << ", " << j.cost_max << ", " << j.deadline << ", " << j.priority << '\n';
  }
}

std::vector<SagJob> read_sag_csv(std::istream& in, const std::string& file_name) {
  // The SAG tools skip the first line; accept a file that begins with a job as well.
  CsvReader rows(in, file_name, kColumns, CsvLayout::by_hand);
  if (rows.header().size() < kColumns.size()) {
    rows.fail("the header names " + std::to_string(rows.header().size()) + " columns instead of " +
                  std::to_string(kColumns.size()),
              "name the tools' columns, or begin with a job");
  }
  std::vector<SagJob> jobs;
  while (rows.next()) jobs.push_back(read_job(rows));
  if (jobs.empty())
    throw InputError(file_name, 0, "no jobs", "give one line per job, with the columns of the header");
  return jobs;
}

}  // namespace hotpath
