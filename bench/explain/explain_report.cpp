// SPDX-License-Identifier: Apache-2.0
#include "explain/explain_report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "program/text.hpp"
#include "program/text_table.hpp"

namespace hotpath::explain {

using nlohmann::json;

namespace {

constexpr std::size_t kNamed = 3;  // jobs named in a sentence
constexpr std::size_t kRows = 12;  // of a table of jobs

std::string ms(double value) { return program::fixed(value, value < 1 ? 3 : 1) + " ms"; }
std::string percent(double part, double whole) {
  return program::fixed(whole > 0 ? 100 * part / whole : 0, 0) + " %";
}

/// A quantity of a sentence.
struct Item {
  double ms = 0;
  std::string text;
};

/// The largest items first, without those below `least` ms.
std::vector<Item> largest(std::vector<Item> items, double least = 0) {
  std::erase_if(items, [&](const Item& item) { return !(item.ms > 0 && item.ms >= least); });
  std::ranges::stable_sort(items, std::greater<>(), &Item::ms);
  return items;
}

/// A part of a sentence that begins with its list; empty without one.
std::string after(const char* beginning, const std::string& list) {
  return list.empty() ? "" : beginning + list;
}

std::string listed(const std::vector<Item>& items, std::size_t most, auto&& text) {
  std::string list;
  const std::size_t count = std::min(items.size(), most);
  for (std::size_t i = 0; i < count; ++i) {
    list += (i == 0 ? "" : i + 1 == count ? " and " : ", ") + text(items[i]);
  }
  return list;
}

std::string shares(const std::vector<Item>& items, double whole, const char* joint = " for ") {
  return listed(items, kCauses, [&](const Item& i) {
    return program::concat(ms(i.ms), " (", percent(i.ms, whole), ")", joint, i.text);
  });
}

/// The causes with their times, as `value` gives them.
std::vector<Item> causes(const std::function<double(Cause)>& value, double least = 0) {
  std::vector<Item> items;
  for (const auto& [cause, word] : enum_texts(Cause{})) items.push_back({value(cause), phrase(cause)});
  return largest(std::move(items), least);
}

std::string because(const Behind& behind) {
  if (behind.rule != Rule::none) return to_string(behind.rule);
  return behind.cause == Cause::executor ? "" : phrase(behind.cause);
}

double sum_of(const std::vector<Item>& items) {
  double sum = 0;
  for (const Item& item : items) sum += item.ms;
  return sum;
}

/// The sum of gains or losses and, if there are several, the share of each in this sum.
std::string apart(const std::vector<Item>& items, const char* joint, const char* after = "") {
  const double sum = sum_of(items);
  if (items.size() == 1) return program::concat(ms(sum), after, joint, items.front().text);
  return program::concat(ms(sum), after, ", of which ", shares(largest(items, sum / 100), sum, joint));
}

/// The jobs behind which most time passed.
std::string longest_waits(const TaskSet& set, const Totals& totals) {
  std::vector<Item> items;
  for (const auto& [behind, sum] : totals.behind) {
    items.push_back(
        {totals.mean_ms(behind), program::concat(set[behind.task].name, " (", because(behind), ")")});
  }
  return listed(largest(std::move(items)), kNamed,
                [](const Item& i) { return program::concat(ms(i.ms), " behind ", i.text); });
}

std::string name_of(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? "" : program::concat(set[job.task].name, " ", job.sequence);
}

/// A column of the tables.
struct Column {
  std::string name;
  const Totals& totals;
};

void write_tables(std::ostream& out, const TaskSet& set, const std::vector<Column>& columns) {
  std::vector<std::string> header = {""};
  for (const Column& column : columns) header.push_back(column.name);
  program::TextTable table("Cause: mean in ms", header);
  const auto add = [&](const std::string& name, const std::function<double(const Totals&)>& value,
                       bool any = false) {
    std::vector<program::TextTable::Cell> row = {name};
    for (const Column& column : columns) {
      any |= value(column.totals) > 0;
      row.emplace_back(program::fixed(value(column.totals), 3));
    }
    if (any) table.add_row(row);
  };
  for (const auto& [cause, word] : enum_texts(Cause{})) {
    add(phrase(cause), [c = cause](const Totals& totals) { return totals.mean_ms(c); });
  }
  add(
      "latency", [](const Totals& totals) { return totals.mean_ms(totals.latency); }, true);
  std::set<Behind> all;
  for (const Column& column : columns) {
    for (const auto& [behind, sum] : column.totals.behind) all.insert(behind);
  }
  out << table << "\n";
  if (all.empty()) return;
  std::vector<Behind> keys(all.begin(), all.end());
  std::ranges::stable_sort(keys, std::greater<>(), [&](const Behind& key) {
    double most = 0;
    for (const Column& column : columns) most = std::max(most, column.totals.mean_ms(key));
    return most;
  });
  keys.resize(std::min(keys.size(), kRows));
  header.insert(header.end(), {"cause", "because"});
  program::TextTable jobs("Behind: mean in ms", header);
  for (const Behind& key : keys) {
    std::vector<program::TextTable::Cell> row = {set[key.task].name};
    for (const Column& column : columns) row.emplace_back(program::fixed(column.totals.mean_ms(key), 3));
    row.emplace_back(phrase(key.cause));
    row.emplace_back(to_string(key.rule));
    jobs.add_row(row);
  }
  out << jobs;
}

void write_lines(std::ostream& out, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) out << line << "\n";
  out << "\n";
}

void note_missing(std::ostream& out, const Subject& subject) {
  if (subject.missing == 0) return;
  out << "\n"
      << subject.missing << " outputs under " << subject.executor
      << " are not explained: the trace lacks their jobs, or their data is younger than the sink's job.\n";
}

json causes_json(const CauseTimes& times) {
  json all = json::object();
  for (const auto& [cause, word] : enum_texts(Cause{}))
    all[word] = times[static_cast<std::size_t>(cause)].count();
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
  json j = {{"executor", subject.executor}, {"not_explained", subject.missing}};
  subject.chain.empty() ? j["task"] = subject.task : j["chain"] = subject.chain;
  return j;
}

json job_json(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? json() : json{{"task", set[job.task].name}, {"sequence", job.sequence}};
}

}  // namespace

std::vector<std::string> sentences(const Subject& subject, const Explanation& e) {
  const JobRef first = e.path.front().job.ref(), last = e.path.back().job.ref();
  Totals totals;
  totals.add(e);
  const std::string under = program::concat(" under ", subject.executor, " (repetition ", e.repetition, ")");
  const std::string latency = ms(to_ms(e.latency)), longest = longest_waits(subject.set, totals);
  std::vector<std::string> all;
  if (subject.chain.empty()) {
    all.push_back(program::concat("Job ", name_of(subject.set, last), under, " finished ", latency,
                                  " after its timestamp."));
  } else {
    all.push_back(program::concat("Output ", last.sequence, " of ", subject.chain, under, " took ", latency,
                                  ", from the start of ", name_of(subject.set, first), " to the start of ",
                                  name_of(subject.set, last), "."));
  }
  const std::vector<Item> items = causes([&](Cause cause) { return totals.mean_ms(cause); });
  if (!items.empty()) all.push_back(program::concat("Its causes: ", shares(items, to_ms(e.latency)), "."));
  if (!longest.empty()) all.push_back(program::concat("The longest waits were ", longest, "."));
  return all;
}

std::vector<std::string> sentences(const Subject& subject, const Overview& o) {
  const double mean = o.all.mean_ms(o.all.latency), median = o.middle.mean_ms(o.middle.latency);
  const double tail = o.tail.mean_ms(o.tail.latency);
  const TaskSet& set = subject.set;
  const std::string what = subject.chain.empty() ? program::concat("responses of ", subject.task)
                                                 : program::concat("outputs of ", subject.chain);
  std::vector<std::string> all = {program::concat(
      "The ", o.all.outputs, " ", what, " under ", subject.executor, " take ", ms(mean), " on average",
      after(": ", shares(causes([&](Cause cause) { return o.all.mean_ms(cause); }, mean / 100), mean)), ".")};
  const std::string longest = longest_waits(set, o.all);
  if (!longest.empty()) all.push_back(program::concat("The longest waits are, on average, ", longest, "."));
  const std::vector<Item> grown =
      causes([&](Cause cause) { return o.tail.mean_ms(cause) - o.middle.mean_ms(cause); });
  if (tail <= median || grown.empty()) {
    all.push_back("No output takes longer than the median.");
    return all;
  }
  const double excess = tail - median;
  const std::vector<Item> shrunk =
      causes([&](Cause cause) { return o.middle.mean_ms(cause) - o.tail.mean_ms(cause); }, excess / 100);
  std::vector<Item> jobs;
  for (const auto& [key, sum] : o.tail.behind) {
    const double more = o.tail.mean_ms(key) - o.middle.mean_ms(key);
    jobs.push_back({more, program::concat(set[key.task].name, " (", because(key), ")")});
  }
  jobs = largest(std::move(jobs));
  if (!shrunk.empty() || (!jobs.empty() && jobs.front().ms > excess)) {
    all.push_back(program::concat(
        "Compared with the median (", ms(median), "), the worst ", percent(kTail, 1), " (", o.tail.outputs,
        " of ", o.all.outputs, " outputs, on average ", ms(tail), ") spend ", apart(grown, " on ", " more"),
        shrunk.empty() ? "" : program::concat("; and ", apart(shrunk, " on ", " less")), ".",
        jobs.empty() ? ""
                     : program::concat(" The wait that grows most is ", ms(jobs.front().ms),
                                       " longer, behind ", jobs.front().text, ".")));
    return all;
  }
  all.push_back(program::concat(
      "Of the worst ", percent(kTail, 1), " (", o.tail.outputs, " of ", o.all.outputs,
      " outputs, on average ", ms(tail), "), ", percent(grown.front().ms, excess),
      " of the excess over the median (", ms(median), ") is ", grown.front().text,
      jobs.empty()
          ? ""
          : program::concat("; ", percent(jobs.front().ms, excess), " is waiting behind ", jobs.front().text),
      "."));
  return all;
}

std::vector<std::string> sentences(const Subject& a, const Subject& b, const Comparison& c) {
  const double of_a = c.a.mean_ms(c.a.latency), of_b = c.b.mean_ms(c.b.latency), gain = std::abs(of_a - of_b);
  const std::string outputs =
      c.paired ? program::concat(c.a.outputs, " outputs with the data of the same source jobs")
               : program::concat(c.a.outputs, " and ", c.b.outputs, " outputs, not paired");
  if (gain == 0)
    return {program::concat(a.executor, " and ", b.executor, " are equally fast (", outputs, ").")};
  const Subject &fast = of_b < of_a ? b : a, &slow = of_b < of_a ? a : b;
  const Totals &less = of_b < of_a ? c.b : c.a, &more = of_b < of_a ? c.a : c.b;
  const auto saved =
      causes([&](Cause cause) { return more.mean_ms(cause) - less.mean_ms(cause); }, gain / 100);
  const auto added =
      causes([&](Cause cause) { return less.mean_ms(cause) - more.mean_ms(cause); }, gain / 100);
  std::vector<std::string> all = {
      program::concat(fast.executor, " is faster than ", slow.executor, " by ", ms(gain), " on average, ",
                      ms(std::min(of_a, of_b)), " instead of ", ms(std::max(of_a, of_b)), " (", outputs,
                      ")."),
      added.empty()
          ? program::concat("It saves ", shares(saved, sum_of(saved), " of "), ".")
          : program::concat("It saves ", apart(saved, " for "), "; it adds ", apart(added, " for "), ".")};
  std::map<TaskId, double> by_task;
  for (const auto& [behind, sum] : more.behind) by_task[behind.task] += more.mean_ms(behind);
  for (const auto& [behind, sum] : less.behind) by_task[behind.task] -= less.mean_ms(behind);
  std::vector<Item> shorter;
  shorter.reserve(by_task.size());
  for (const auto& [task, difference] : by_task) shorter.push_back({difference, slow.set[task].name});
  const std::string waits = listed(largest(std::move(shorter)), kNamed, [](const Item& i) {
    return program::concat(ms(i.ms), " behind ", i.text);
  });
  if (!waits.empty()) all.push_back(program::concat("An output waits less: ", waits, "."));
  return all;
}

void write(std::ostream& out, const Subject& subject, const Explanation& e) {
  write_lines(out, sentences(subject, e));
  program::TextTable table("", {"from\nms", "for\nms", "cause", "job", "behind", "because"});
  Duration from{};
  for (const Part& part : e.parts) {
    table.add_row({program::fixed(to_ms(from), 3), program::fixed(to_ms(part.length), 3), phrase(part.cause),
                   name_of(subject.set, e.path[part.step].job.ref()), name_of(subject.set, part.behind),
                   to_string(part.rule)});
    from += part.length;
  }
  out << table;
  if (!e.complete) out << "\nThe trace lacks jobs on the path; it is followed back as far as possible.\n";
}

void write(std::ostream& out, const Subject& subject, const Overview& o) {
  write_lines(out, sentences(subject, o));
  const std::string worst = program::concat("worst ", percent(kTail, 1));
  write_tables(out, subject.set, {{"all", o.all}, {"median", o.middle}, {worst, o.tail}});
  note_missing(out, subject);
}

void write(std::ostream& out, const Subject& a, const Subject& b, const Comparison& c) {
  write_lines(out, sentences(a, b, c));
  write_tables(out, a.set, {{a.executor, c.a}, {b.executor, c.b}});
  note_missing(out, a);
  note_missing(out, b);
}

json json_of(const Subject& subject, const Explanation& e) {
  json j = subject_json(subject);
  j.update({{"repetition", e.repetition},
            {"sequence", e.path.back().job.sequence},
            {"latency_ns", e.latency.count()},
            {"complete", e.complete},
            {"causes_ns", causes_json(causes_of(e))},
            {"sentences", sentences(subject, e)}});
  for (const JobRecord& r : e.path) {
    json job = job_json(subject.set, r.job.ref());
    job["start_ns"] = to_ns(r.start);
    job["finish_ns"] = r.outcome == Outcome::ran ? json(to_ns(r.finish)) : json();
    j["path"].push_back(job);
  }
  j["parts"] = json::array();
  for (const Part& part : e.parts) {
    j["parts"].push_back({{"cause", to_string(part.cause)},
                          {"rule", to_string(part.rule)},
                          {"job", job_json(subject.set, e.path[part.step].job.ref())},
                          {"behind", job_json(subject.set, part.behind)},
                          {"ns", part.length.count()}});
  }
  return j;
}

json json_of(const Subject& subject, const Overview& o) {
  json j = subject_json(subject);
  j.update({{"all", totals_json(subject.set, o.all)},
            {"median", totals_json(subject.set, o.middle)},
            {"tail", totals_json(subject.set, o.tail)},
            {"tail_percent", 100 * kTail},
            {"sentences", sentences(subject, o)}});
  return j;
}

json json_of(const Subject& a, const Subject& b, const Comparison& c) {
  json of_a = subject_json(a), of_b = subject_json(b);
  of_a.update(totals_json(a.set, c.a));
  of_b.update(totals_json(b.set, c.b));
  return {{"a", of_a}, {"b", of_b}, {"paired", c.paired}, {"sentences", sentences(a, b, c)}};
}

}  // namespace hotpath::explain
