// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/trace_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <istream>
#include <ostream>
#include <string_view>
#include <unordered_map>

namespace hotpath {

const char* const kJobsCsvHeader =
    "executor,repetition,task,kind,sequence,outcome,timestamp_ns,release_ns,start_ns,finish_ns,cpu_ns,"
    "deadline_ns,"
    "worker,cpu,process,parent_task,parent_sequence";
const char* const kChainsCsvHeader =
    "executor,repetition,chain,sequence,hot_path_latency_ns,end_to_end_latency_ns";

namespace {

constexpr std::size_t kColumns = 17;

/// Builds one line without a stream's formatting, which dominates otherwise.
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

}  // namespace

void write_jobs_csv(std::ostream& out, const TaskSet& set, const Trace& trace) {
  Line line;
  const auto instant = [&](Time t) { line.number((t - trace.epoch).count()); };
  for (const JobRecord& r : trace.jobs) {
    const Task& task = set[r.job.task];
    const bool timer = task.kind == TaskKind::timer;
    const auto head = [&](std::uint64_t sequence, Outcome outcome, Time timestamp) {
      line.begin();
      line.text(trace.executor)
          .number(trace.repetition)
          .text(task.name)
          .text(timer ? "timer" : "subscription");
      line.number(sequence).text(to_string(outcome));
      instant(timestamp);
    };
    const auto deadline = [&](Time t) { t == kNever ? void(line.nothing()) : instant(t); };
    const bool started =
        r.outcome == Outcome::ran || r.outcome == Outcome::running || r.outcome == Outcome::empty;
    const bool finished = r.outcome == Outcome::ran || r.outcome == Outcome::empty;

    head(r.job.sequence, r.outcome, r.job.timestamp);
    // A sample that is still unread at the end may never have been released.
    const bool released = r.outcome != Outcome::overwritten && r.job.release >= r.job.timestamp;
    released ? instant(r.job.release) : void(line.nothing());
    started ? instant(r.start) : void(line.nothing());
    finished ? instant(r.finish) : void(line.nothing());
    r.cpu_time.count() >= 0 ? line.number(r.cpu_time.count()) : line.nothing();
    deadline(r.job.deadline);
    started ? line.number(unsigned{r.worker}) : line.nothing();
    r.cpu >= 0 ? line.number(int{r.cpu}) : line.nothing();
    line.number(r.process);
    if (r.job.parent.task == kNoTask) {
      line.nothing().nothing();
    } else {
      line.text(set[r.job.parent.task].name).number(r.job.parent.sequence);
    }
    line.write(out);

    for (std::uint32_t k = 1; k <= r.job.skipped; ++k) {
      head(r.job.sequence + k, Outcome::skipped, r.job.timestamp + k * task.period);
      line.nothing().nothing().nothing().nothing();
      deadline(r.job.deadline == kNever ? kNever : r.job.deadline + k * task.period);
      line.nothing().nothing().number(r.process).nothing().nothing();
      line.write(out);
    }
  }
}

void write_chains_csv(std::ostream& out, const std::vector<std::string>& chain_names, const Trace& trace) {
  Line line;
  for (const ChainRecord& r : trace.chains) {
    line.begin();
    line.text(trace.executor).number(trace.repetition).text(chain_names[r.chain]).number(r.sequence);
    line.number(r.hot_path_latency.count());
    r.end_to_end_latency.count() >= 0 ? line.number(r.end_to_end_latency.count()) : line.nothing();
    line.write(out);
  }
}

namespace {

class JobsCsvReader {
 public:
  JobsCsvReader(const TaskSet& set, std::string file) : set_(set), file_(std::move(file)) {
    for (TaskId id = 0; id < set.size(); ++id) ids_.emplace(set[id].name, id);
  }

  void header(std::string_view text) {
    line_ = 1;
    if (text != kJobsCsvHeader) fail(std::string("the header must be `") + kJobsCsvHeader + "`");
  }

  void row(std::string_view text, std::vector<Trace>& traces) {
    ++line_;
    split(text);
    Trace& trace = trace_for(traces);
    JobRecord r;
    r.job.task = task(field_[2]);
    check_kind(set_[r.job.task].kind);
    r.job.sequence = number<std::uint64_t>(4);
    r.outcome = outcome(field_[5]);
    r.job.timestamp = instant(6);
    if (r.outcome == Outcome::skipped) {
      // Rows of skipped timestamps follow the job whose call skipped them.
      if (trace.jobs.empty() || trace.jobs.back().job.task != r.job.task ||
          r.job.sequence != trace.jobs.back().job.sequence + trace.jobs.back().job.skipped + 1) {
        fail("a `skipped` row must follow the job of the same task whose call skipped it, in sequence");
      }
      ++trace.jobs.back().job.skipped;
      return;
    }
    check_instants(r.outcome);
    if (!field_[7].empty()) r.job.release = instant(7);
    if (!field_[8].empty()) r.start = instant(8);
    if (!field_[9].empty()) r.finish = instant(9);
    if (!field_[10].empty()) r.cpu_time = Duration(number<std::int64_t>(10));
    if (!field_[11].empty()) r.job.deadline = instant(11);
    if (!field_[12].empty()) r.worker = number<std::uint8_t>(12);
    if (!field_[13].empty()) r.cpu = number<std::int16_t>(13);
    r.process = number<std::uint16_t>(14);
    if (!field_[15].empty()) r.job.parent = {task(field_[15]), number<std::uint64_t>(16)};
    r.job.empty = r.outcome == Outcome::empty;
    trace.jobs.push_back(r);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw TraceCsvError(file_ + ":" + std::to_string(line_) + ": " + what);
  }

  void split(std::string_view text) {
    std::size_t column = 0, from = 0;
    for (;;) {
      const std::size_t comma = text.find(',', from);
      if (column == kColumns) fail("more than " + std::to_string(kColumns) + " columns");
      field_[column++] = text.substr(from, comma == text.npos ? text.npos : comma - from);
      if (comma == text.npos) break;
      from = comma + 1;
    }
    if (column != kColumns) {
      fail(std::to_string(column) + " columns instead of " + std::to_string(kColumns));
    }
  }

  template <class Integer>
  Integer number(std::size_t column) const {
    Integer value{};
    const std::string_view f = field_[column];
    const auto [end, error] = std::from_chars(f.data(), f.data() + f.size(), value);
    if (error != std::errc{} || end != f.data() + f.size()) {
      fail("column " + std::to_string(column + 1) + " is not a whole number in range: `" + std::string(f) +
           "`");
    }
    return value;
  }
  Time instant(std::size_t column) const { return from_ns(number<std::int64_t>(column)); }

  TaskId task(std::string_view name) const {
    const auto found = ids_.find(std::string(name));
    if (found == ids_.end())
      fail("the graph has no task `" + std::string(name) + "`; is this another graph's trace?");
    return found->second;
  }

  void check_kind(TaskKind kind) const {
    const char* const expected = kind == TaskKind::timer ? "timer" : "subscription";
    if (field_[3] != expected) {
      fail("task `" + std::string(field_[2]) + "` is a " + expected + ", not a `" + std::string(field_[3]) +
           "`");
    }
  }

  void check_instants(Outcome outcome) const {
    const bool finished = outcome == Outcome::ran || outcome == Outcome::empty;
    const bool started = finished || outcome == Outcome::running;
    if (field_[8].empty() == started || field_[9].empty() == finished) {
      fail(std::string("a row `") + to_string(outcome) + "` must have " + (started ? "a" : "no") +
           " start_ns and " + (finished ? "a" : "no") + " finish_ns");
    }
  }

  Outcome outcome(std::string_view name) const {
    for (const Outcome o : {Outcome::ran, Outcome::skipped, Outcome::overwritten, Outcome::queued,
                            Outcome::running, Outcome::empty}) {
      if (name == to_string(o)) return o;
    }
    fail("unknown outcome `" + std::string(name) + "`");
  }

  Trace& trace_for(std::vector<Trace>& traces) const {
    const auto repetition = number<std::uint32_t>(1);
    const auto same = [&](const Trace& t) { return t.repetition == repetition && t.executor == field_[0]; };
    if (!traces.empty() && same(traces.back())) return traces.back();
    const auto found = std::find_if(traces.begin(), traces.end(), same);
    if (found != traces.end()) return *found;
    Trace& added = traces.emplace_back();
    added.executor = field_[0];
    added.repetition = repetition;
    return added;
  }

  const TaskSet& set_;
  std::string file_;
  std::unordered_map<std::string, TaskId> ids_;
  std::size_t line_ = 0;
  std::array<std::string_view, kColumns> field_;
};

}  // namespace

std::vector<Trace> read_jobs_csv(std::istream& in, const TaskSet& set, const std::string& file_name) {
  JobsCsvReader reader(set, file_name);
  std::vector<Trace> traces;
  std::string text;
  std::getline(in, text);
  reader.header(text);
  while (std::getline(in, text)) reader.row(text, traces);
  return traces;
}

}  // namespace hotpath
