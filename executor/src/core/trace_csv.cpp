// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/trace_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <ostream>
#include <string_view>
#include <unordered_map>

#include "hotpath/core/csv.hpp"

namespace hotpath {

namespace {

/// Builds a line without stream formatting, which would dominate the time.
class Line {
 public:
  void begin() { text_.clear(); }
  Line& text(std::string_view s) {
    separate();
    text_ += s;
    return *this;
  }
  template <class Integer>
  Line& number(Integer n) {
    separate();
    std::array<char, 24> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), n).ptr;
    text_.append(digits.data(), end);
    return *this;
  }
  Line& nothing() { return text({}); }
  void write(std::ostream& out) {
    text_ += '\n';
    out.write(text_.data(), static_cast<std::streamsize>(text_.size()));
  }

 private:
  void separate() {
    if (!text_.empty()) text_ += ',';
  }
  std::string text_;
};

constexpr bool finishes(Outcome outcome) { return outcome == Outcome::ran || outcome == Outcome::empty; }
constexpr bool starts(Outcome outcome) { return finishes(outcome) || outcome == Outcome::running; }

/// A row being written.
struct RowOut {
  const TaskSet& set;
  const Trace& trace;
  const JobRecord& r;
  Line& line;

  /// Writes the number if it applies, otherwise an empty field.
  template <class Integer>
  void number_if(bool applies, Integer n) const {
    applies ? line.number(n) : line.nothing();
  }
  void instant_if(bool applies, Time t) const { number_if(applies, (t - trace.epoch).count()); }
};

/// The tasks of a set by name.
class TaskNames {
 public:
  explicit TaskNames(const TaskSet& tasks) : set(tasks) {
    for (TaskId id = 0; id < set.size(); ++id) ids_.emplace(set[id].name, id);
  }

  TaskId find(const CsvReader& in, std::size_t column) const {
    const auto known = ids_.find(in.text(column));
    if (known != ids_.end()) return known->second;
    in.fail("the graph has no task `" + std::string(in.text(column)) + "`",
            "give a trace of this graph, not of another graph");
  }
  void check_kind(const CsvReader& in, std::size_t column, TaskId id) const {
    if (in.text(column) == to_string(set[id].kind)) return;
    in.fail("task `" + set[id].name + "` is a " + to_string(set[id].kind) + ", not a `" +
                std::string(in.text(column)) + "`",
            "give a trace of this graph, not of another graph");
  }

  const TaskSet& set;

 private:
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view name) const { return std::hash<std::string_view>{}(name); }
  };
  std::unordered_map<std::string, TaskId, Hash, std::equal_to<>> ids_;
};

/// A row being read.
struct RowIn {
  const CsvReader& in;
  const TaskNames& tasks;
  std::string_view executor{};
  std::uint32_t repetition = 0;
  JobRecord r{};
};

Outcome outcome_of(const CsvReader& in, std::size_t column) {
  if (const auto outcome = parse<Outcome>(in.text(column))) return *outcome;
  in.fail("unknown outcome `" + std::string(in.text(column)) + "`", "docs/results.md lists them");
}

Time instant(const RowIn& row, std::size_t column) { return Time{} + row.in.nanoseconds(column); }

enum class Field { required, may_be_empty };

/// A column of jobs.csv: its name, and how its field is written and read. Empty fields are not
/// read.
struct JobColumn {
  const char* name;
  Field field;
  void (*write)(const RowOut&);
  void (*read)(RowIn&, std::size_t column);
};

constexpr JobColumn kJobColumns[] = {
    {"executor", Field::required, [](const RowOut& o) { o.line.text(o.trace.executor); },
     [](RowIn& i, std::size_t c) { i.executor = i.in.text(c); }},
    {"repetition", Field::required, [](const RowOut& o) { o.line.number(o.trace.repetition); },
     [](RowIn& i, std::size_t c) { i.repetition = i.in.number<std::uint32_t>(c); }},
    {"task", Field::required, [](const RowOut& o) { o.line.text(o.set[o.r.job.task].name); },
     [](RowIn& i, std::size_t c) { i.r.job.task = i.tasks.find(i.in, c); }},
    {"kind", Field::required, [](const RowOut& o) { o.line.text(to_string(o.set[o.r.job.task].kind)); },
     [](RowIn& i, std::size_t c) { i.tasks.check_kind(i.in, c, i.r.job.task); }},
    {"sequence", Field::required, [](const RowOut& o) { o.line.number(o.r.job.sequence); },
     [](RowIn& i, std::size_t c) { i.r.job.sequence = i.in.number<std::uint64_t>(c); }},
    {"outcome", Field::required, [](const RowOut& o) { o.line.text(to_string(o.r.outcome)); },
     [](RowIn& i, std::size_t c) { i.r.outcome = outcome_of(i.in, c); }},
    {"timestamp_ns", Field::required, [](const RowOut& o) { o.instant_if(true, o.r.job.timestamp); },
     [](RowIn& i, std::size_t c) { i.r.job.timestamp = instant(i, c); }},
    // A sample still unread at the end may never have been released.
    {"release_ns", Field::may_be_empty,
     [](const RowOut& o) {
       const bool never = o.r.outcome == Outcome::overwritten || o.r.outcome == Outcome::skipped;
       o.instant_if(!never && o.r.job.release >= o.r.job.timestamp, o.r.job.release);
     },
     [](RowIn& i, std::size_t c) { i.r.job.release = instant(i, c); }},
    {"start_ns", Field::may_be_empty, [](const RowOut& o) { o.instant_if(starts(o.r.outcome), o.r.start); },
     [](RowIn& i, std::size_t c) { i.r.start = instant(i, c); }},
    {"finish_ns", Field::may_be_empty,
     [](const RowOut& o) { o.instant_if(finishes(o.r.outcome), o.r.finish); },
     [](RowIn& i, std::size_t c) { i.r.finish = instant(i, c); }},
    {"cpu_ns", Field::may_be_empty,
     [](const RowOut& o) { o.number_if(o.r.cpu_time.count() >= 0, o.r.cpu_time.count()); },
     [](RowIn& i, std::size_t c) { i.r.cpu_time = i.in.nanoseconds(c); }},
    {"deadline_ns", Field::may_be_empty,
     [](const RowOut& o) { o.instant_if(o.r.job.deadline != kNever, o.r.job.deadline); },
     [](RowIn& i, std::size_t c) { i.r.job.deadline = instant(i, c); }},
    {"worker", Field::may_be_empty,
     [](const RowOut& o) { o.number_if(starts(o.r.outcome), unsigned{o.r.worker}); },
     [](RowIn& i, std::size_t c) { i.r.worker = i.in.number<std::uint16_t>(c); }},
    {"cpu", Field::may_be_empty, [](const RowOut& o) { o.number_if(o.r.cpu >= 0, int{o.r.cpu}); },
     [](RowIn& i, std::size_t c) { i.r.cpu = i.in.number<std::int16_t>(c); }},
    {"process", Field::required, [](const RowOut& o) { o.line.number(o.r.process); },
     [](RowIn& i, std::size_t c) { i.r.process = i.in.number<std::uint16_t>(c); }},
    {"parent_task", Field::may_be_empty,
     [](const RowOut& o) {
       const TaskId parent = o.r.job.parent.task;
       parent == kNoTask ? o.line.nothing() : o.line.text(o.set[parent].name);
     },
     [](RowIn& i, std::size_t c) { i.r.job.parent.task = i.tasks.find(i.in, c); }},
    {"parent_sequence", Field::may_be_empty,
     [](const RowOut& o) { o.number_if(o.r.job.parent.task != kNoTask, o.r.job.parent.sequence); },
     [](RowIn& i, std::size_t c) { i.r.job.parent.sequence = i.in.number<std::uint64_t>(c); }},
};

constexpr std::size_t place_of(std::string_view name) {
  std::size_t place = 0;
  while (kJobColumns[place].name != name) ++place;
  return place;
}

void write_row(const RowOut& row, std::ostream& out) {
  row.line.begin();
  for (const JobColumn& column : kJobColumns) column.write(row);
  row.line.write(out);
}

/// The `k`-th timestamp that the call of job `r` skipped.
JobRecord skipped_by(const JobRecord& r, std::uint32_t k, Duration period) {
  JobRecord skipped;
  skipped.job.task = r.job.task;
  skipped.job.sequence = r.job.sequence + k;
  skipped.job.timestamp = r.job.timestamp + k * period;
  if (r.job.deadline != kNever) skipped.job.deadline = r.job.deadline + k * period;
  skipped.outcome = Outcome::skipped;
  skipped.process = r.process;
  return skipped;
}

std::string jobs_csv_header() {
  std::string header;
  for (const JobColumn& column : kJobColumns)
    header += (header.empty() ? "" : ",") + std::string(column.name);
  return header;
}

}  // namespace

const std::string kJobsCsvHeader = jobs_csv_header();
constexpr std::string_view kSinkTask = "sink_task", kFinish = "finish_ns";
const std::string kChainsCsvHeader =
    "executor,repetition,chain,sequence,hot_path_latency_ns,end_to_end_latency_ns,sink_task,finish_ns,"
    "disparity_ns";

void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace) {
  Line line;
  for (const JobRecord& r : trace.jobs) {
    write_row({set, trace, r, line}, out);
    for (std::uint32_t k = 1; k <= r.job.skipped; ++k) {
      write_row({set, trace, skipped_by(r, k, set[r.job.task].period), line}, out);
    }
  }
}

void write_chains_csv(std::ostream& out, const TaskSet& set, const std::vector<std::string>& chain_names,
                      const Trace& trace) {
  Line line;
  for (const ChainRecord& r : trace.chains) {
    line.begin();
    line.text(trace.executor).number(trace.repetition).text(chain_names[r.chain]).number(r.sequence);
    line.number(r.hot_path_latency.count());
    r.end_to_end_latency.count() >= 0 ? line.number(r.end_to_end_latency.count()) : line.nothing();
    r.sink != kNoTask ? line.text(set[r.sink].name) : line.nothing();
    r.finish != kNever ? line.number((r.finish - trace.epoch).count()) : line.nothing();
    r.disparity.count() >= 0 ? line.number(r.disparity.count()) : line.nothing();
    line.write(out);
  }
}

namespace {

void check_instants(const CsvReader& in, Outcome outcome) {
  constexpr std::size_t kStart = place_of("start_ns"), kFinish = place_of("finish_ns");
  if (in.text(kStart).empty() != starts(outcome) && in.text(kFinish).empty() != finishes(outcome)) return;
  in.fail(std::string("a row `") + to_string(outcome) + "` must have " + (starts(outcome) ? "a" : "no") +
              " start_ns and " + (finishes(outcome) ? "a" : "no") + " finish_ns",
          "restore the original file");
}

/// Adds a skipped timestamp. Its row must follow the job whose call skipped it: `last` of the
/// repetition, if any.
void add_skipped(const RowIn& row, JobRecord* last) {
  if (last == nullptr || last->job.task != row.r.job.task ||
      row.r.job.sequence != last->job.sequence + last->job.skipped + 1) {
    row.in.fail("a `skipped` row must follow the job of the same task whose call skipped it, in sequence",
                "keep the order of the rows");
  }
  Job& job = last->job;
  ++job.skipped;
  // The timestamp is not stored: it follows from the job's, if the period is known already (not 0).
  const Duration period = row.tasks.set[job.task].period, after = row.r.job.timestamp - job.timestamp;
  if (period > Duration{} && (after / period != job.skipped || after % period != Duration{})) {
    row.in.fail("a `skipped` timestamp is not a whole number of periods after its job's timestamp",
                "give a trace of this graph, not of another graph");
  }
}

Trace& trace_for(const JobRow& row, std::vector<Trace>& traces) {
  const auto same = [&](const Trace& t) {
    return t.repetition == row.repetition && t.executor == row.executor;
  };
  if (!traces.empty() && same(traces.back())) return traces.back();
  const auto existing = std::find_if(traces.begin(), traces.end(), same);
  if (existing != traces.end()) return *existing;
  Trace& added = traces.emplace_back();
  added.executor = row.executor;
  added.repetition = row.repetition;
  return added;
}

void read_rows(std::istream& stream, const TaskSet& set, const std::string& file_name, const auto& use) {
  const TaskNames tasks(set);
  CsvReader in(stream, file_name);
  in.require_header(kJobsCsvHeader);
  while (in.next()) {
    RowIn row{in, tasks};
    for (std::size_t c = 0; c < std::size(kJobColumns); ++c) {
      if (kJobColumns[c].field == Field::may_be_empty && in.text(c).empty()) continue;
      kJobColumns[c].read(row, c);
    }
    check_instants(in, row.r.outcome);
    row.r.job.empty = row.r.outcome == Outcome::empty;
    use(row);
  }
}

}  // namespace

void for_each_job(std::istream& in, const TaskSet& set, const std::string& file_name,
                  const std::function<void(const JobRow&)>& use) {
  read_rows(in, set, file_name, [&](const RowIn& row) {
    use({row.executor, row.repetition, row.r, row.in.line()});
  });
}

void for_each_record(std::istream& in, const TaskSet& set, const std::string& file_name,
                     const std::function<void(const JobRow&)>& use) {
  std::string executor;
  std::uint32_t repetition = 0;
  std::optional<JobRecord> last;  // complete when a row other than `skipped` follows
  std::size_t line = 0;
  const auto use_last = [&] {
    if (last) use({executor, repetition, *last, line});
  };
  read_rows(in, set, file_name, [&](const RowIn& row) {
    const bool same = last && row.repetition == repetition && row.executor == executor;
    if (row.r.outcome == Outcome::skipped) return add_skipped(row, same ? &*last : nullptr);
    use_last();
    if (!same) executor = row.executor;
    repetition = row.repetition;
    last = row.r;
    line = row.in.line();
  });
  use_last();
}

std::vector<Trace> read_jobs_csv(std::istream& in, const TaskSet& set, const std::string& file_name) {
  std::vector<Trace> traces;
  for_each_record(in, set, file_name,
                  [&](const JobRow& row) { trace_for(row, traces).jobs.push_back(row.record); });
  return traces;
}

void for_each_chain(std::istream& stream, const TaskSet& set, const std::vector<std::string>& chains,
                    const std::string& file_name, const std::function<void(const ChainRow&)>& use) {
  CsvReader in(stream, file_name);
  const auto sink_task = in.find_column(kSinkTask), finish = in.find_column(kFinish);
  // Older files end before one of these columns.
  const std::size_t end =
      finish ? std::string::npos : kChainsCsvHeader.find(sink_task ? kFinish : kSinkTask) - 1;
  in.require_header(kChainsCsvHeader.substr(0, end));
  const TaskNames tasks(set);
  while (in.next()) {
    ChainRow row{std::string(in.text(0)), in.number<std::uint32_t>(1), in.line(), {}};
    const auto chain = std::ranges::find(chains, in.text(2));
    if (chain == chains.end())
      in.fail("run.json names no chain `" + std::string(in.text(2)) + "`",
              "the files do not belong to one run");
    row.record.chain = static_cast<std::uint32_t>(chain - chains.begin());
    row.record.sequence = in.number<std::uint64_t>(3);
    row.record.hot_path_latency = in.nanoseconds(4);
    if (!in.text(5).empty()) row.record.end_to_end_latency = in.nanoseconds(5);
    if (sink_task && !in.text(*sink_task).empty()) row.record.sink = tasks.find(in, *sink_task);
    if (finish && !in.text(*finish).empty()) row.record.finish = Time{} + in.nanoseconds(*finish);
    if (finish && !in.text(*finish + 1).empty()) row.record.disparity = in.nanoseconds(*finish + 1);
    use(row);
  }
}

}  // namespace hotpath
