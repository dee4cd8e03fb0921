// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/trace_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <concepts>
#include <optional>
#include <ostream>
#include <span>
#include <string_view>
#include <unordered_map>

#include "hotpath/core/csv.hpp"

namespace hotpath {

namespace {

constexpr bool finishes(Outcome outcome) { return outcome == Outcome::ran || outcome == Outcome::empty; }
constexpr bool starts(Outcome outcome) { return finishes(outcome) || outcome == Outcome::running; }

// Fields that the row's other fields do not show to be what they are.
template <class Id>
struct TaskName {
  explicit TaskName(Id& task) : id(task) {}
  Id& id;
};
struct KindOfTask {
  TaskId id;
};
template <class Number>
struct ChainName {
  explicit ChainName(Number& number) : chain(number) {}
  Number& chain;
};

/// Visits the columns of jobs.csv: their names and fields, and for those that may be empty, whether the field
/// of this row is written. `run` has the executor and the repetition.
void visit_job(auto& visit, auto&& run, auto&& r) {
  const bool released = r.outcome != Outcome::overwritten && r.outcome != Outcome::skipped &&
                        r.job.release >= r.job.timestamp;  // a sample still unread at the end may never be
  visit("executor", run.executor);
  visit("repetition", run.repetition);
  visit("task", TaskName{r.job.task});
  visit("kind", KindOfTask{r.job.task});
  visit("sequence", r.job.sequence);
  visit("outcome", r.outcome);
  visit("timestamp_ns", r.job.timestamp);
  visit("release_ns", r.job.release, released);
  visit("start_ns", r.start, starts(r.outcome));
  visit("finish_ns", r.finish, finishes(r.outcome));
  visit("cpu_ns", r.cpu_time, r.cpu_time.count() >= 0);
  visit("deadline_ns", r.job.deadline, r.job.deadline != kNever);
  visit("worker", r.worker, starts(r.outcome));
  visit("cpu", r.cpu, r.cpu >= 0);
  visit("process", r.process);
  visit("parent_task", TaskName{r.job.parent.task}, r.job.parent.task != kNoTask);
  visit("parent_sequence", r.job.parent.sequence, r.job.parent.task != kNoTask);
}

/// Visits the columns of chains.csv.
void visit_chain(auto& visit, auto&& run, auto&& r) {
  visit("executor", run.executor);
  visit("repetition", run.repetition);
  visit("chain", ChainName{r.chain});
  visit("sequence", r.sequence);
  visit("hot_path_latency_ns", r.hot_path_latency);
  visit("end_to_end_latency_ns", r.end_to_end_latency, r.end_to_end_latency.count() >= 0);
  visit("sink_task", TaskName{r.sink}, r.sink != kNoTask);
  visit("finish_ns", r.finish, r.finish != kNever);
  visit("disparity_ns", r.disparity, r.disparity.count() >= 0);
}

/// Builds rows without stream formatting, which would dominate the time.
class RowWriter {
 public:
  RowWriter(std::ostream& out, const TaskSet& set, Time epoch, std::span<const std::string> chains = {})
      : out_(out), set_(set), epoch_(epoch), chains_(chains) {}
  void operator()(std::string_view, const auto& field, bool applies = true) {
    if (!text_.empty()) text_ += ',';
    if (applies) add(field);
  }
  void end_row() {
    text_ += '\n';
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

 private:
  void add(std::string_view text) { text_ += text; }
  void add(std::integral auto number) {
    std::array<char, 24> digits;
    text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  }
  void add(Duration duration) { add(duration.count()); }
  void add(Time instant) { add(instant - epoch_); }
  void add(Outcome outcome) { add(std::string_view(to_string(outcome))); }
  void add(TaskName<const TaskId> task) { add(std::string_view(set_[task.id].name)); }
  void add(KindOfTask task) { add(std::string_view(to_string(set_[task.id].kind))); }
  void add(ChainName<const std::uint32_t> name) { add(std::string_view(chains_[name.chain])); }

  std::ostream& out_;
  const TaskSet& set_;
  const Time epoch_;
  const std::span<const std::string> chains_;
  std::string text_;
};

/// Reads the fields of the row that `in` is at.
class RowReader {
 public:
  RowReader(const CsvReader& in, const TaskSet& set, std::span<const std::string> chains = {})
      : in_(in), set_(set), chains_(chains) {
    for (TaskId id = 0; id < set.size(); ++id) ids_.emplace(set[id].name, id);
  }
  void begin_row() { column_ = 0; }
  void operator()(std::string_view, auto&& field) { read(column_++, field); }
  /// Leaves a field as it is if it is empty.
  void operator()(std::string_view, auto&& field, bool) {
    const std::size_t column = column_++;
    if (!in_.text(column).empty()) read(column, field);
  }

 private:
  static constexpr const char* kThisGraph = "give a trace of this graph, not of another graph";

  void read(std::size_t column, std::string_view& text) const { text = in_.text(column); }
  void read(std::size_t column, std::string& text) const { text = in_.text(column); }
  template <std::integral Number>
  void read(std::size_t column, Number& number) const {
    number = in_.number<Number>(column);
  }
  void read(std::size_t column, Duration& duration) const { duration = in_.nanoseconds(column); }
  void read(std::size_t column, Time& instant) const { instant = Time{} + in_.nanoseconds(column); }
  void read(std::size_t column, Outcome& outcome) const {
    const auto known = parse<Outcome>(in_.text(column));
    if (!known) in_.fail(concat("unknown outcome `", in_.text(column), "`"), "docs/results.md lists them");
    outcome = *known;
  }
  void read(std::size_t column, TaskName<TaskId> task) const {
    const auto known = ids_.find(in_.text(column));
    if (known == ids_.end()) in_.fail(concat("the graph has no task `", in_.text(column), "`"), kThisGraph);
    task.id = known->second;
  }
  void read(std::size_t column, KindOfTask task) const {
    const std::string kind = to_string(set_[task.id].kind);
    if (in_.text(column) == kind) return;
    in_.fail(concat("task `", set_[task.id].name, "` is a ", kind, ", not a `", in_.text(column), "`"),
             kThisGraph);
  }
  void read(std::size_t column, ChainName<std::uint32_t> name) const {
    const auto known = std::ranges::find(chains_, in_.text(column));
    if (known == chains_.end())
      in_.fail(concat("run.json names no chain `", in_.text(column), "`"),
               "the files do not belong to one run");
    name.chain = static_cast<std::uint32_t>(known - chains_.begin());
  }

  const CsvReader& in_;
  const TaskSet& set_;
  const std::span<const std::string> chains_;
  std::unordered_map<std::string_view, TaskId> ids_;
  std::size_t column_ = 0;
};

/// The names of the columns.
std::string header(const auto& visit_columns) {
  std::vector<std::string_view> names;
  const auto visit = [&](std::string_view name, const auto&, bool = true) { names.push_back(name); };
  visit_columns(visit);
  return joined(names, ",");
}

/// The `k`-th timestamp that the call of job `r` skipped.
JobRecord skipped_by(const JobRecord& r, std::uint32_t k, Duration period) {
  JobRecord skipped{.job = {.task = r.job.task}, .outcome = Outcome::skipped, .process = r.process};
  skipped.job.sequence = r.job.sequence + k;
  skipped.job.timestamp = r.job.timestamp + k * period;
  if (r.job.deadline != kNever) skipped.job.deadline = r.job.deadline + k * period;
  return skipped;
}

}  // namespace

const std::string kJobsCsvHeader = header([](auto& visit) { visit_job(visit, Trace{}, JobRecord{}); });
const std::string kChainsCsvHeader = header([](auto& visit) { visit_chain(visit, Trace{}, ChainRecord{}); });

void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace) {
  RowWriter writer(out, set, trace.epoch);
  const auto write = [&](const JobRecord& r) {
    visit_job(writer, trace, r);
    writer.end_row();
  };
  for (const JobRecord& r : trace.jobs) {
    write(r);
    for (std::uint32_t k = 1; k <= r.job.skipped; ++k) write(skipped_by(r, k, set[r.job.task].period));
  }
}

void write_chains_csv(std::ostream& out, const TaskSet& set, const std::vector<std::string>& chain_names,
                      const Trace& trace) {
  RowWriter writer(out, set, trace.epoch, chain_names);
  for (const ChainRecord& r : trace.chains) {
    visit_chain(writer, trace, r);
    writer.end_row();
  }
}

namespace {

/// Adds a skipped timestamp. Its row must follow the job whose call skipped it: `last` of the
/// repetition, if any.
void add_skipped(const JobRow& row, const TaskSet& set, const std::string& file, JobRecord* last) {
  const Job& skipped = row.record.job;
  const auto line = static_cast<std::int64_t>(row.line);
  if (last == nullptr || last->job.task != skipped.task ||
      skipped.sequence != last->job.sequence + last->job.skipped + 1) {
    throw InputError(
        file, line, "a `skipped` row must follow the job of the same task whose call skipped it, in sequence",
        "keep the order of the rows");
  }
  Job& job = last->job;
  ++job.skipped;
  // The timestamp is not stored: it follows from the job's, if the period is known already (not 0).
  const Duration period = set[job.task].period, after = skipped.timestamp - job.timestamp;
  if (period > Duration{} && (after / period != job.skipped || after % period != Duration{})) {
    throw InputError(file, line,
                     "a `skipped` timestamp is not a whole number of periods after its job's timestamp",
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

}  // namespace

void for_each_job(std::istream& stream, const TaskSet& set, const std::string& file_name,
                  const std::function<void(const JobRow&)>& use) {
  CsvReader in(LineReader(stream, file_name));
  in.require_header(kJobsCsvHeader);
  const std::size_t start = in.column("start_ns"), finish = in.column("finish_ns");
  RowReader reader(in, set);
  while (in.next()) {
    struct {
      std::string_view executor;
      std::uint32_t repetition;
    } run{};
    JobRecord r;
    reader.begin_row();
    visit_job(reader, run, r);
    if (in.text(start).empty() == starts(r.outcome) || in.text(finish).empty() == finishes(r.outcome)) {
      in.fail(concat("a row `", to_string(r.outcome), "` must have ", starts(r.outcome) ? "a" : "no",
                     " start_ns and ", finishes(r.outcome) ? "a" : "no", " finish_ns"),
              "restore the original file");
    }
    r.job.empty = r.outcome == Outcome::empty;
    use({run.executor, run.repetition, r, in.line()});
  }
}

void for_each_record(std::istream& stream, const TaskSet& set, const std::string& file_name,
                     const std::function<void(const JobRow&)>& use) {
  std::string executor;
  std::uint32_t repetition = 0;
  std::optional<JobRecord> last;  // complete when a row other than `skipped` follows
  std::size_t line = 0;
  const auto use_last = [&] {
    if (last) use({executor, repetition, *last, line});
  };
  for_each_job(stream, set, file_name, [&](const JobRow& row) {
    const bool same = last && row.repetition == repetition && row.executor == executor;
    if (row.record.outcome == Outcome::skipped)
      return add_skipped(row, set, file_name, same ? &*last : nullptr);
    use_last();
    if (!same) executor = row.executor;
    repetition = row.repetition;
    last = row.record;
    line = row.line;
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
  CsvReader in(LineReader(stream, file_name));
  in.require_header(kChainsCsvHeader);
  RowReader reader(in, set, chains);
  while (in.next()) {
    ChainRow row;
    row.line = in.line();
    reader.begin_row();
    visit_chain(reader, row, row.record);
    use(row);
  }
}

}  // namespace hotpath
