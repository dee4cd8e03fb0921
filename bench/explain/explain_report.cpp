// SPDX-License-Identifier: Apache-2.0
#include "explain/explain.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <optional>
#include <set>

#include "program/table.hpp"
#include "program/text.hpp"

namespace hotpath::explain {

namespace {

using nlohmann::json;
using program::concat, program::fixed, program::joined, program::Table;

constexpr std::size_t kNamed = 3;  // jobs named in a sentence
constexpr std::size_t kRows = 12;  // of a table of jobs

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
  for (const auto& [key, time] : of.times) {
    if (!key.waited()) continue;
    const bool by_rule = key.rule != Rule::none || key.cause == Cause::executor;
    items.push_back(
        {of.mean_ms(key) - minus.mean_ms(key),
         concat(set[key.task].name, " (", by_rule ? to_string(key.rule) : phrase(key.cause), ")")});
  }
  return largest(std::move(items));
}

/// All with their shares of `whole`, or a few.
std::string listed(const Items& items, const char* joint, std::optional<double> whole = {}) {
  std::string list;
  const std::size_t count = whole ? items.size() : std::min(items.size(), kNamed);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string share = whole ? concat(" (", percent(items[i].ms, *whole), ")") : "";
    const char* const before = i == 0 ? "" : i + 1 == count ? " and " : ", ";
    list += concat(before, ms(items[i].ms), share, joint, items[i].text);
  }
  return list;
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
  return concat(ms(sum), after, ", of which ", listed(largest(items, sum / 100), joint, sum));
}

/// A sentence that ends with the jobs behind which most time passed, if there are any.
void add_waits(std::vector<std::string>& sentences, const std::string& beginning, const Items& items,
               const char* joint = " behind ") {
  if (!items.empty()) sentences.push_back(concat(beginning, listed(items, joint), "."));
}

/// If running on the path is a part of the difference: whose jobs are only on one path, or take longer there.
void add_paths(std::vector<std::string>& sentences, const TaskSet& set, const std::string& of_a,
               const Totals& a, const std::string& of_b, const Totals& b) {
  const double least = std::abs(a.mean_ms() - b.mean_ms()) / 100;
  if (std::abs(a.mean_ms(Cause::running) - b.mean_ms(Cause::running)) < least || least == 0) return;
  for (const auto& [of, more, less] : {std::tuple(of_a, &a, &b), {of_b, &b, &a}}) {
    Items longer;
    for (const auto& [key, time] : more->times) {
      if (key.cause == Cause::running)
        longer.push_back({more->mean_ms(key) - less->mean_ms(key), set[key.task].name});
    }
    add_waits(sentences, concat("On average, the path ", of, " has "), largest(std::move(longer), least),
              " more of ");
  }
}

/// The largest mean of a row, and its cells.
using Row = std::pair<double, std::vector<program::Value>>;

/// `columns`: headers and totals.
std::string tables(const TaskSet& set, const std::vector<std::pair<std::string, const Totals&>>& columns) {
  std::vector<std::string> header = {""};
  std::set<Totals::Key> keys;
  for (const auto& [name, totals] : columns) {
    header.push_back(name);
    for (const auto& [key, time] : totals.times)
      if (key.waited()) keys.insert(key);
  }
  const auto row_of = [&](const std::string& name, const auto&... key) {
    Row row(0, {name});
    for (const auto& [column, totals] : columns) {
      const double mean = totals.mean_ms(key...);
      row.second.emplace_back(fixed(mean, 3));
      row.first = std::max(row.first, mean);
    }
    return row;
  };
  Table causes("Cause: mean in ms", header);
  for (const CauseText& cause : kCauseTexts) {
    if (const Row row = row_of(cause.phrase, cause.value); row.first > 0) causes.add_row(row.second);
  }
  causes.add_row(row_of("latency").second);
  if (keys.empty()) return concat(causes, "\n");
  std::vector<Row> rows;
  for (const Totals::Key& key : keys) {
    Row& row = rows.emplace_back(row_of(set[key.task].name, key));
    row.second.insert(row.second.end(), {phrase(key.cause), to_string(key.rule)});
  }
  std::ranges::stable_sort(rows, std::greater<>(), &Row::first);
  rows.resize(std::min(rows.size(), kRows));
  header.insert(header.end(), {"cause", "because"});
  Table jobs("Behind: mean in ms", header);
  for (const Row& row : rows) jobs.add_row(row.second);
  return concat(causes, "\n", jobs);
}

/// What is missing, then the warnings.
std::string notes(std::initializer_list<const Subject*> subjects) {
  std::string missing, warnings;
  for (const Subject* const of : subjects) {
    if (of->missing > 0)
      missing += concat("\n", of->missing, " outputs under ", of->executor,
                        " are not explained: the trace lacks their jobs, or their data is younger than the "
                        "sink's job.\n");
    if (!of->warnings.empty()) warnings += concat("\n", joined(of->warnings, "\n"), "\n");
  }
  return missing + warnings;
}

json causes_json(const Totals& totals) {
  json all;
  for (const CauseText& cause : kCauseTexts) all[cause.text] = totals.sum(cause.value).count();
  return all;
}

/// Sums over the outputs.
json totals_json(const TaskSet& set, const Totals& totals) {
  json behind = json::array();
  for (const auto& [key, time] : totals.times) {
    if (!key.waited()) continue;
    behind.push_back({{"cause", to_string(key.cause)},
                      {"rule", to_string(key.rule)},
                      {"task", set[key.task].name},
                      {"mean_ms", totals.mean_ms(key)}});
  }
  return {{"outputs", totals.outputs},
          {"latency_ns", totals.latency.count()},
          {"causes_ns", causes_json(totals)},
          {"behind", behind}};
}

json subject_json(const Subject& subject) {
  return {{"executor", subject.executor},
          {"not_explained", subject.missing},
          {"warnings", subject.warnings},
          {subject.latency == Latency::response ? "task" : "chain", subject.name},
          {"latency", to_string(subject.latency)}};
}

json job_json(const TaskSet& set, JobRef job) {
  return job.task == kNoTask ? json() : json{{"task", set[job.task].name}, {"sequence", job.sequence}};
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
  const bool mixed = !shrunk.empty() || (!jobs.empty() && jobs.front().ms > excess);
  std::string text =
      mixed ? concat("Compared with the median (", ms(median), "), the ", worst, " spend ",
                     apart(grown, " on ", " more"))
            : concat("Of the ", worst, ", ", percent(grown.front().ms, excess),
                     " of the excess over the median (", ms(median), ") is ", grown.front().text);
  if (!shrunk.empty()) text += concat(", but ", apart(shrunk, " on ", " less"));
  if (jobs.empty()) return text + ".";
  const Item& wait = jobs.front();
  return text +
         (mixed ? concat(". The wait that grows most is ", ms(wait.ms), " longer, behind ", wait.text, ".")
                : concat("; ", percent(wait.ms, excess), " is waiting behind ", wait.text, "."));
}

/// What each lacks, which no mean shows.
std::string loss_sentence(const Subject& a, const Subject& b) {
  const auto fewer = [](const Subject& of, const Subject& than) {
    const std::string count =
        concat(of.fewer, of.latency == Latency::response ? " job" : " output", of.fewer > 1 ? "s" : "");
    return concat(of.executor, " lacks ", of.fewer == 0 ? "none" : count, " that ", than.executor, " has");
  };
  return concat(fewer(a, b), ", ", fewer(b, a), ": lost, or cut off where the run begins or ends.");
}

/// Which one is faster, and what it saves.
std::vector<std::string> gain_sentences(const Subject& a, const Totals& of_a, const Subject& b,
                                        const Totals& of_b) {
  const double mean_a = of_a.mean_ms(), mean_b = of_b.mean_ms(), gain = std::abs(mean_a - mean_b);
  const char* const of = a.latency == Latency::age ? "age of the data, " : "hot path, ";
  const std::string outputs =
      concat(a.latency == Latency::response ? "" : of, of_a.outputs, " and ", of_b.outputs, " outputs");
  if (gain == 0) return {concat(a.executor, " and ", b.executor, " are equally fast (", outputs, ").")};
  const Subject &fast = mean_b < mean_a ? b : a, &slow = mean_b < mean_a ? a : b;
  const Totals &less = mean_b < mean_a ? of_b : of_a, &more = mean_b < mean_a ? of_a : of_b;
  const Items saved = causes(more, less, gain / 100), added = causes(less, more, gain / 100);
  std::vector<std::string> all = {
      concat(fast.executor, " is faster than ", slow.executor, " by ", ms(gain), " on average, ",
             ms(std::min(mean_a, mean_b)), " instead of ", ms(std::max(mean_a, mean_b)), " (", outputs, ")."),
      added.empty() ? concat("It saves ", listed(saved, " of ", sum_of(saved)), ".")
                    : concat("It saves ", apart(saved, " for "), "; it adds ", apart(added, " for "), ".")};
  std::map<TaskId, double> by_task;
  for (const auto& [totals, sign] : {std::pair(&more, 1), {&less, -1}}) {
    for (const auto& [key, time] : totals->times)
      if (key.waited()) by_task[key.task] += sign * totals->mean_ms(key);
  }
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
  if (subject.latency == Latency::response)
    return concat("Job ", last, under, " finished ", latency, " after its timestamp.");
  const std::string output = concat("output ", e.path.back().job.sequence, " of ", subject.name, under);
  if (subject.latency == Latency::hot_path)
    return concat("The hot path to ", output, " took ", latency, ", from the start of ", first,
                  " to the start of ", last, ".");
  return concat("The oldest data in ", output, " was ", latency, " old, from the timestamp of ", first,
                " to the finish of ", last, ".");
}

}  // namespace

Report report(const Subject& subject, const Explanation& e) {
  const TaskSet& set = subject.set;
  Totals totals;
  totals.add(e);
  Report r;
  r.sentences.push_back(first_sentence(subject, e));
  const Items items = causes(totals);
  if (!items.empty())
    r.sentences.push_back(concat("Its causes: ", listed(items, " for ", to_ms(e.latency)), "."));
  add_waits(r.sentences, "The longest waits were ", waits(set, totals));

  r.data = subject_json(subject);
  r.data.update({{"repetition", e.repetition},
                 {"sequence", e.path.back().job.sequence},
                 {"latency_ns", e.latency.count()},
                 {"complete", e.complete},
                 {"causes_ns", causes_json(totals)},
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
  r.text = concat(table, e.waits.empty() ? "" : "\n");
  for (const ThreadsInWait& wait : e.waits) {
    r.data["waits"].push_back(wait.sentence);
    r.text += wait.sentence + "\n";
  }
  if (!e.complete) r.text += "\nThe trace lacks jobs on the path; it is followed back as far as possible.\n";
  r.text += notes({&subject});
  return r;
}

Report report(const Subject& subject, const Overview& o) {
  const double mean = o.all.mean_ms();
  const std::string list = listed(causes(o.all, {}, mean / 100), " for ", mean);
  Report r;
  const std::string outputs =
      concat(o.all.outputs, subject.latency == Latency::response ? " responses of " : " outputs of ",
             subject.name, " under ", subject.executor);
  const std::string sentence =
      subject.latency == Latency::age ? concat("The oldest data in the ", outputs, " is ", ms(mean), " old")
      : subject.latency == Latency::hot_path ? concat("The hot path to the ", outputs, " takes ", ms(mean))
                                             : concat("The ", outputs, " take ", ms(mean));
  r.sentences.push_back(concat(sentence, " on average", list.empty() ? "" : ": ", list, "."));
  add_waits(r.sentences, "The longest waits are, on average, ", waits(subject.set, o.all));
  r.sentences.push_back(excess_of_tail(subject.set, o));
  add_paths(r.sentences, subject.set, "of the " + worst_share(), o.tail, "of the median", o.middle);
  r.text = tables(subject.set, {{"all", o.all}, {"median", o.middle}, {worst_share(), o.tail}}) +
           notes({&subject});
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
  if (a.fewer + b.fewer > 0) r.sentences.insert(r.sentences.begin() + 1, loss_sentence(a, b));
  r.text = tables(a.set, {{a.executor, of_a}, {b.executor, of_b}}) + notes({&a, &b});
  for (const auto& [side, subject, totals] : {std::tuple("a", &a, &of_a), std::tuple("b", &b, &of_b)}) {
    r.data[side] = subject_json(*subject);
    r.data[side]["fewer_outputs"] = subject->fewer;
    r.data[side].update(totals_json(subject->set, *totals));
  }
  return r;
}

}  // namespace hotpath::explain
