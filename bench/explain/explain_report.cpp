// SPDX-License-Identifier: Apache-2.0
#include "explain/explain_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "program/table.hpp"
#include "program/text.hpp"

namespace hotpath::explain {

namespace {

using nlohmann::json;
using program::concat, program::fixed, program::joined, program::Table;

constexpr std::size_t kNamed = 3;  // jobs named in a sentence
constexpr std::size_t kRows = 12;  // of a table of jobs
constexpr const char* kIncomplete =
    "\nThe trace lacks jobs on the path; it is followed back as far as possible.\n";

std::string ms(double value) { return fixed(value, value < 1 ? 3 : 1) + " ms"; }
std::string ms(Duration value) { return fixed(to_ms(value), 3); }  // of a table
std::string percent(double part, double whole) { return fixed(whole > 0 ? 100 * part / whole : 0, 0) + " %"; }
std::string worst_share() { return "worst " + percent(kTail, 1); }

/// A quantity of a sentence.
struct Item {
  double ms = 0;
  std::string text;
};
using Items = std::vector<Item>;

/// The largest items first, without those below `least` ms.
Items largest(Items items, double least = 0) {
  std::erase_if(items, [&](const Item& item) { return !(item.ms > 0 && item.ms >= least); });
  std::ranges::stable_sort(items, std::greater<>(), &Item::ms);
  return items;
}

/// The causes with their times in `of`, without those in `minus`.
Items causes(const Totals& of, const Totals& minus = {}, double least = 0) {
  Items items;
  for (const CauseText& cause : kCauseTexts)
    items.push_back({of.mean_ms(cause.value) - minus.mean_ms(cause.value), cause.phrase});
  return largest(std::move(items), least);
}

/// The waits in `of` with their times, without those in `minus`.
Items waits(const TaskSet& set, const Totals& of, const Totals& minus = {}) {
  Items items;
  for (const auto& [behind, sum] : of.behind) {
    const char* const because = behind.rule != Rule::none         ? to_string(behind.rule)
                                : behind.cause == Cause::executor ? ""
                                                                  : phrase(behind.cause);
    items.push_back(
        {of.mean_ms(behind) - minus.mean_ms(behind), concat(set[behind.task].name, " (", because, ")")});
  }
  return largest(std::move(items));
}

std::string listed(const Items& items, std::size_t most, auto&& text) {
  std::string list;
  const std::size_t count = std::min(items.size(), most);
  for (std::size_t i = 0; i < count; ++i)
    list += (i == 0 ? "" : i + 1 == count ? " and " : ", ") + text(items[i]);
  return list;
}

std::string shares(const Items& items, double whole, const char* joint = " for ") {
  return listed(items, kCauses, [&](const Item& i) {
    return concat(ms(i.ms), " (", percent(i.ms, whole), ")", joint, i.text);
  });
}

double sum_of(const Items& items) {
  double sum = 0;
  for (const Item& item : items) sum += item.ms;
  return sum;
}

/// The sum of gains or losses and, if there are several, the share of each in this sum.
std::string apart(const Items& items, const char* joint, const char* after = "") {
  const double sum = sum_of(items);
  if (items.size() == 1) return concat(ms(sum), after, joint, items.front().text);
  return concat(ms(sum), after, ", of which ", shares(largest(items, sum / 100), sum, joint));
}

/// A sentence that ends with the jobs behind which most time passed, if there are any.
void add_waits(std::vector<std::string>& sentences, const std::string& beginning, const Items& items,
               const char* joint = " behind ") {
  const std::string list =
      listed(items, kNamed, [&](const Item& i) { return concat(ms(i.ms), joint, i.text); });
  if (!list.empty()) sentences.push_back(concat(beginning, list, "."));
}

/// If running on the path is a part of the difference: whose jobs are only on one path, or take longer there.
void add_paths(std::vector<std::string>& sentences, const TaskSet& set, const std::string& of_a,
               const Totals& a, const std::string& of_b, const Totals& b) {
  const double least = std::abs(a.mean_ms() - b.mean_ms()) / 100;
  if (std::abs(a.mean_ms(Cause::running) - b.mean_ms(Cause::running)) < least || least == 0) return;
  for (const auto& [of, more, less] : {std::tuple(of_a, &a, &b), {of_b, &b, &a}}) {
    Items longer;
    for (const auto& [task, sum] : more->running)
      longer.push_back({more->running_ms(task) - less->running_ms(task), set[task].name});
    add_waits(sentences, concat("On average, the path ", of, " has "), largest(std::move(longer), least),
              " more of ");
  }
}

std::string name_of(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? "" : concat(set[job.task].name, " ", job.sequence);
}

/// The totals of a column of the tables, and its header.
using Columns = std::vector<std::pair<std::string, const Totals&>>;

/// A row with a mean of each column; `most`: the largest of them.
struct Row {
  double most = 0;
  std::vector<program::Value> cells;
};

std::string tables(const TaskSet& set, const Columns& columns) {
  std::vector<std::string> header = {""};
  std::set<Behind> keys;
  for (const auto& [name, totals] : columns) {
    header.push_back(name);
    for (const auto& [behind, sum] : totals.behind) keys.insert(behind);
  }
  const auto row_of = [&](const std::string& name, const auto&... key) {
    Row row{0, {name}};
    for (const auto& [column, totals] : columns) {
      const double mean = totals.mean_ms(key...);
      row.cells.emplace_back(fixed(mean, 3));
      row.most = std::max(row.most, mean);
    }
    return row;
  };
  Table causes("Cause: mean in ms", header);
  for (const CauseText& cause : kCauseTexts) {
    if (const Row row = row_of(cause.phrase, cause.value); row.most > 0) causes.add_row(row.cells);
  }
  causes.add_row(row_of("latency").cells);
  if (keys.empty()) return concat(causes, "\n");
  std::vector<Row> rows;
  for (const Behind& key : keys) {
    Row& row = rows.emplace_back(row_of(set[key.task].name, key));
    row.cells.emplace_back(phrase(key.cause));
    row.cells.emplace_back(to_string(key.rule));
  }
  std::ranges::stable_sort(rows, std::greater<>(), &Row::most);
  rows.resize(std::min(rows.size(), kRows));
  header.insert(header.end(), {"cause", "because"});
  Table jobs("Behind: mean in ms", header);
  for (const Row& row : rows) jobs.add_row(row.cells);
  return concat(causes, "\n", jobs);
}

std::string note_missing(const Subject& subject) {
  if (subject.missing == 0) return "";
  return concat("\n", subject.missing, " outputs under ", subject.executor,
                " are not explained: the trace lacks their jobs, or their data is younger than the sink's "
                "job.\n");
}

std::string warnings_of(const Subject& subject) {
  return subject.warnings.empty() ? "" : concat("\n", joined(subject.warnings, "\n"), "\n");
}

json causes_json(const CauseTimes& times) {
  json all = json::object();
  for (const CauseText& cause : kCauseTexts)
    all[cause.text] = times[static_cast<std::size_t>(cause.value)].count();
  return all;
}

/// Sums over the outputs.
json totals_json(const TaskSet& set, const Totals& totals) {
  json behind = json::array();
  for (const auto& [key, sum] : totals.behind) {
    behind.push_back({{"cause", to_string(key.cause)},
                      {"rule", to_string(key.rule)},
                      {"task", set[key.task].name},
                      {"mean_ms", totals.mean_ms(key)}});
  }
  return {{"outputs", totals.outputs},
          {"latency_ns", totals.latency.count()},
          {"causes_ns", causes_json(totals.causes)},
          {"behind", behind}};
}

json subject_json(const Subject& subject) {
  json j = {
      {"executor", subject.executor}, {"not_explained", subject.missing}, {"warnings", subject.warnings}};
  j[subject.latency == Latency::response ? "task" : "chain"] = subject.name;
  j["latency"] = to_string(subject.latency);
  return j;
}

json job_json(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? json() : json{{"task", set[job.task].name}, {"sequence", job.sequence}};
}

/// A sentence for each wait, in ms from the beginning of the latency: what every thread did.
std::vector<std::string> wait_sentences(const Subject& subject, const Explanation& e) {
  const JobRecord& sink = e.path.back();
  const Time begin = (subject.latency == Latency::hot_path ? sink.start : sink.finish) - e.latency;
  const auto from_to = [&](Time from, Time to) {
    return concat(ms(from - begin), " to ", to == kNever ? "the end of the run" : ms(to - begin));
  };
  std::vector<std::string> sentences;
  for (const ThreadsInWait& wait : e.waits) {
    std::string threads;
    for (const auto& [worker, ran] : wait.threads) {
      threads += concat(threads.empty() ? "" : "; ", "thread ", worker, " ran ", ran.empty() ? "no job" : "");
      for (const ThreadsInWait::Ran& r : ran)
        threads += concat(&r == &ran.front() ? "" : ", ", name_of(subject.set, r.job), " (",
                          from_to(r.start, r.finish), r.same_group ? ", in its callback group)" : ")");
    }
    sentences.push_back(concat(name_of(subject.set, e.path[wait.step].job.ref()), " waited from ",
                               from_to(wait.from, wait.to), " ms: ", threads, "."));
  }
  return sentences;
}

/// The sentence about the outputs in the tail.
std::string excess_of_tail(const TaskSet& set, const Overview& o) {
  const double median = o.middle.mean_ms(), tail = o.tail.mean_ms(), excess = tail - median;
  const Items grown = causes(o.tail, o.middle);
  if (tail <= median || grown.empty()) return "No output takes longer than the median.";
  const Items shrunk = causes(o.middle, o.tail, excess / 100);
  const Items jobs = waits(set, o.tail, o.middle);
  const bool equals =
      static_cast<double>(o.tail.outputs) > 2 + 2 * kTail * static_cast<double>(o.all.outputs);
  const std::string worst = concat(worst_share(), equals ? " and equal ones (" : " (", o.tail.outputs, " of ",
                                   o.all.outputs, " outputs, on average ", ms(tail), ")");
  if (!shrunk.empty() || (!jobs.empty() && jobs.front().ms > excess)) {
    return concat("Compared with the median (", ms(median), "), the ", worst, " spend ",
                  apart(grown, " on ", " more"),
                  shrunk.empty() ? "" : concat(", but ", apart(shrunk, " on ", " less")), ".",
                  jobs.empty() ? ""
                               : concat(" The wait that grows most is ", ms(jobs.front().ms),
                                        " longer, behind ", jobs.front().text, "."));
  }
  return concat(
      "Of the ", worst, ", ", percent(grown.front().ms, excess), " of the excess over the median (",
      ms(median), ") is ", grown.front().text,
      jobs.empty() ? ""
                   : concat("; ", percent(jobs.front().ms, excess), " is waiting behind ", jobs.front().text),
      ".");
}

/// What each lacks, which no mean shows; empty: both have as many outputs.
std::vector<std::string> loss_sentences(const Subject& a, const Subject& b) {
  if (a.fewer + b.fewer == 0) return {};
  const auto fewer = [](const Subject& of, const Subject& than) {
    const std::string count =
        concat(of.fewer, of.latency == Latency::response ? " job" : " output", of.fewer > 1 ? "s" : "");
    return concat(of.executor, " lacks ", of.fewer == 0 ? "none" : count, " that ", than.executor, " has");
  };
  return {concat(fewer(a, b), ", ", fewer(b, a), ": lost, or cut off where the run begins or ends.")};
}

/// Which one is faster, and what it saves.
std::vector<std::string> gain_sentences(const Subject& a, const Totals& of_a, const Subject& b,
                                        const Totals& of_b) {
  const double mean_a = of_a.mean_ms(), mean_b = of_b.mean_ms(), gain = std::abs(mean_a - mean_b);
  const std::string outputs = concat(a.latency == Latency::response   ? ""
                                     : a.latency == Latency::hot_path ? "hot path, "
                                                                      : "age of the data, ",
                                     of_a.outputs, " and ", of_b.outputs, " outputs");
  if (gain == 0) return {concat(a.executor, " and ", b.executor, " are equally fast (", outputs, ").")};
  const Subject &fast = mean_b < mean_a ? b : a, &slow = mean_b < mean_a ? a : b;
  const Totals &less = mean_b < mean_a ? of_b : of_a, &more = mean_b < mean_a ? of_a : of_b;
  const Items saved = causes(more, less, gain / 100), added = causes(less, more, gain / 100);
  std::vector<std::string> all = {
      concat(fast.executor, " is faster than ", slow.executor, " by ", ms(gain), " on average, ",
             ms(std::min(mean_a, mean_b)), " instead of ", ms(std::max(mean_a, mean_b)), " (", outputs, ")."),
      added.empty() ? concat("It saves ", shares(saved, sum_of(saved), " of "), ".")
                    : concat("It saves ", apart(saved, " for "), "; it adds ", apart(added, " for "), ".")};
  std::map<TaskId, double> by_task;
  for (const auto& [behind, sum] : more.behind) by_task[behind.task] += more.mean_ms(behind);
  for (const auto& [behind, sum] : less.behind) by_task[behind.task] -= less.mean_ms(behind);
  Items shorter;
  for (const auto& [task, difference] : by_task) shorter.push_back({difference, slow.set[task].name});
  add_waits(all, "An output waits less: ", largest(std::move(shorter)));
  add_paths(all, slow.set, "under " + slow.executor, more, "under " + fast.executor, less);
  return all;
}

std::string first_sentence(const Subject& subject, const Explanation& e) {
  const std::string first = name_of(subject.set, e.path.front().job.ref()),
                    last = name_of(subject.set, e.path.back().job.ref());
  const std::string under = concat(" under ", subject.executor, " (repetition ", e.repetition, ")");
  const std::string latency = ms(to_ms(e.latency));
  const std::string output = concat("output ", e.path.back().job.sequence, " of ", subject.name, under);
  return subject.latency == Latency::response
             ? concat("Job ", last, under, " finished ", latency, " after its timestamp.")
         : subject.latency == Latency::hot_path
             ? concat("The hot path to ", output, " took ", latency, ", from the start of ", first,
                      " to the start of ", last, ".")
             : concat("The oldest data in ", output, " was ", latency, " old, from the timestamp of ", first,
                      " to the finish of ", last, ".");
}

}  // namespace

Report report(const Subject& subject, const Explanation& e) {
  const TaskSet& set = subject.set;
  const std::uint64_t sequence = e.path.back().job.sequence;
  Totals totals;
  totals.add(e);
  Report r;
  r.sentences.push_back(first_sentence(subject, e));
  const Items items = causes(totals);
  if (!items.empty()) r.sentences.push_back(concat("Its causes: ", shares(items, to_ms(e.latency)), "."));
  add_waits(r.sentences, "The longest waits were ", waits(set, totals));

  r.data = subject_json(subject);
  r.data.update({{"repetition", e.repetition},
                 {"sequence", sequence},
                 {"latency_ns", e.latency.count()},
                 {"complete", e.complete},
                 {"causes_ns", causes_json(totals.causes)},
                 {"parts", json::array()}});
  for (const JobRecord& job : e.path) {
    json& step = r.data["path"].emplace_back(job_json(set, job.job.ref()));
    step["start_ns"] = to_ns(job.start);
    step["finish_ns"] = job.outcome == Outcome::ran ? json(to_ns(job.finish)) : json();
  }
  Table table("", {"from\nms", "for\nms", "cause", "job", "behind", "because"});
  Duration from{};
  for (const Part& part : e.parts) {
    const JobRef job = e.path[part.step].job.ref();
    table.add_row({ms(from), ms(part.length), phrase(part.cause), name_of(set, job),
                   name_of(set, part.behind), to_string(part.rule)});
    r.data["parts"].push_back({{"cause", to_string(part.cause)},
                               {"rule", to_string(part.rule)},
                               {"job", job_json(set, job)},
                               {"behind", job_json(set, part.behind)},
                               {"ns", part.length.count()}});
    from += part.length;
  }
  const std::vector<std::string> waits = wait_sentences(subject, e);
  if (!waits.empty()) r.data["waits"] = waits;
  r.text = concat(table, waits.empty() ? "" : concat("\n", joined(waits, "\n"), "\n"),
                  e.complete ? "" : kIncomplete, warnings_of(subject));
  return r;
}

Report report(const Subject& subject, const Overview& o) {
  const double mean = o.all.mean_ms();
  const std::string list = shares(causes(o.all, {}, mean / 100), mean);
  Report r;
  const bool response = subject.latency == Latency::response, age = subject.latency == Latency::age,
             hot_path = subject.latency == Latency::hot_path;
  r.sentences.push_back(concat(
      age        ? "The oldest data in the "
      : hot_path ? "The hot path to the "
                 : "The ",
      o.all.outputs, response ? " responses of " : " outputs of ", subject.name, " under ", subject.executor,
      age        ? " is "
      : hot_path ? " takes "
                 : " take ",
      ms(mean), age ? " old" : "", " on average", list.empty() ? "" : ": ", list, "."));
  add_waits(r.sentences, "The longest waits are, on average, ", waits(subject.set, o.all));
  r.sentences.push_back(excess_of_tail(subject.set, o));
  add_paths(r.sentences, subject.set, "of the " + worst_share(), o.tail, "of the median", o.middle);
  r.text = tables(subject.set, {{"all", o.all}, {"median", o.middle}, {worst_share(), o.tail}}) +
           note_missing(subject) + warnings_of(subject);
  r.data = subject_json(subject);
  r.data.update({{"all", totals_json(subject.set, o.all)},
                 {"median", totals_json(subject.set, o.middle)},
                 {"tail", totals_json(subject.set, o.tail)},
                 {"tail_percent", 100 * kTail}});
  return r;
}

Report report(const Subject& a, const Totals& of_a, const Subject& b, const Totals& of_b) {
  Report r;
  r.sentences = gain_sentences(a, of_a, b, of_b);
  const std::vector<std::string> losses = loss_sentences(a, b);
  r.sentences.insert(r.sentences.begin() + 1, losses.begin(), losses.end());
  r.text = tables(a.set, {{a.executor, of_a}, {b.executor, of_b}}) + note_missing(a) + note_missing(b) +
           warnings_of(a) + warnings_of(b);
  for (const auto& [side, subject, totals] : {std::tuple("a", &a, &of_a), std::tuple("b", &b, &of_b)}) {
    r.data[side] = subject_json(*subject);
    r.data[side]["fewer_outputs"] = subject->fewer;
    r.data[side].update(totals_json(subject->set, *totals));
  }
  return r;
}

}  // namespace hotpath::explain
