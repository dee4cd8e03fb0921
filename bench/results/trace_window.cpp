// SPDX-License-Identifier: Apache-2.0
#include "results/trace_window.hpp"

#include <algorithm>
#include <ostream>

#include "hotpath/core/csv.hpp"
#include "program/text.hpp"

namespace hotpath::results {

void write_window(std::ostream& out, const std::filesystem::path& jobs_csv, const TraceWindow& window) {
  CsvReader in(jobs_csv);
  const std::size_t executor = in.column("executor"), repetition = in.column("repetition"),
                    timestamp = in.column("timestamp_ns"), start = in.column("start_ns"),
                    finish = in.column("finish_ns");
  const auto write_line = [&](auto&& field) {
    for (std::size_t c = 0; c < in.header().size(); ++c) out << (c == 0 ? "" : ",") << field(c);
    out << '\n';
  };
  write_line([&](std::size_t c) { return std::string_view(in.header()[c]); });
  const std::string number = std::to_string(window.repetition);
  while (in.next()) {
    if (in.text(executor) != window.executor || in.text(repetition) != number) continue;
    const Time ready = Time{} + in.nanoseconds(timestamp);
    const bool started = !in.text(start).empty(), finished = !in.text(finish).empty();
    const Time begin = started ? std::min(ready, Time{} + in.nanoseconds(start)) : ready;
    // A job that was running at the end of the run has no finish.
    const Time end = finished ? Time{} + in.nanoseconds(finish) : started ? kNever : ready;
    if (begin >= window.to || std::max(ready, end) < window.from) continue;
    write_line([&](std::size_t c) { return in.text(c); });
  }
}

}  // namespace hotpath::results
