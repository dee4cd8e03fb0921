// SPDX-License-Identifier: Apache-2.0
#include "results/stored_run.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <ostream>

#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "results/measures.hpp"
#include "results/run_facts.hpp"
#include "results/schedule.hpp"

namespace hotpath {

using nlohmann::json;

namespace {

std::string named(const std::string& executor, std::uint32_t repetition) {
  return executor + " (repetition " + std::to_string(repetition) + ")";
}

std::string named(const json& run) {
  return named(run.at("executor").get<std::string>(), run.at("repetition").get<std::uint32_t>());
}

/// Timers of nodes that have subscriptions as well, of the reference system's types: named as their nodes.
std::vector<TaskId> cyclic_timers(const TaskSet& set) {
  std::vector<TaskId> timers;
  for (TaskId id = 0; id < set.size(); ++id) {
    const std::string prefix = set[id].name + "/";
    const auto is_input = [&](const Task& t) { return t.name.starts_with(prefix); };
    const bool named_as_node = set[id].name.find('/') == std::string::npos;
    if (set[id].kind == TaskKind::timer && named_as_node &&
        std::any_of(set.tasks.begin(), set.tasks.end(), is_input)) {
      timers.push_back(id);
    }
  }
  return timers;
}

}  // namespace

StoredRun::StoredRun(std::filesystem::path folder, std::string option)
    : folder_(std::move(folder)), option_(std::move(option)) {
  std::ifstream in(folder_ / "run.json");
  if (!in) fail("there is no run.json; name the folder of a run, as written by `hotpath run`");
  try {
    facts_ = json::parse(in);
    read_facts();
  } catch (const json::exception& error) {
    fail(std::string("its run.json is not one of `hotpath run`: ") + error.what());
  }
}

void StoredRun::read_facts() {
  cores_ = facts_.contains("cpus") ? static_cast<unsigned>(facts_.at("cpus").size())
                                   : facts_.at("platform").at("cores").get<unsigned>();
  executors_ = facts_.at("executors").get<std::vector<std::string>>();
  warm_up_ = from_ms(facts_.at("warm_up_s").get<double>() * 1000);
  length_ = warm_up_ + from_ms(facts_.at("duration_s").get<double>() * 1000);
  if (facts_.contains("chains")) chains_ = facts_["chains"].get<std::vector<std::string>>();
  for (const json& run : facts_.at("runs")) {
    static_cast<void>(named(run));
    for (const auto& first : run.at("first_timestamps_ms")) static_cast<void>(first.get<double>());
  }
}

const json* StoredRun::find_run(const std::string& executor, std::uint32_t repetition) const {
  for (const json& run : facts_.at("runs")) {
    if (run.at("executor") == executor && run.at("repetition") == repetition) return &run;
  }
  return nullptr;
}

std::vector<Duration> StoredRun::first_timestamps(const TaskSet& set, const std::string& executor,
                                                  std::uint32_t repetition) const {
  const json* const run = find_run(executor, repetition);
  if (run == nullptr) fail_missing(executor, repetition);
  const json& first_ms = run->at("first_timestamps_ms");
  std::vector<Duration> first(set.size());
  std::size_t timers = 0;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind != TaskKind::timer) continue;
    ++timers;
    if (!first_ms.contains(set[id].name)) {
      fail("it has no first timestamp for timer " + set[id].name + "; was it of another graph?");
    }
    first[id] = from_ms(first_ms[set[id].name].get<double>());
  }
  if (timers != first_ms.size()) {
    fail("it has first timestamps for " + std::to_string(first_ms.size()) + " timers, the graph has " +
         std::to_string(timers) + "; was it of another graph?");
  }
  return first;
}

void StoredRun::load() {
  std::optional<TaskSet> set;
  try {
    if (facts_.contains("tasks")) set = tasks_from_json(facts_["tasks"]);
  } catch (const json::exception& error) {
    fail(std::string("its run.json is not one of `hotpath run`: ") + error.what());
  }
  if (!set) {  // runs of older versions do not name their tasks
    set = read_jobs(nullptr);
    order_as_in_summary(*set);
  }
  load(*set);
}

/// The tasks of a summary are in the graph's order, which jobs.csv alone does not tell.
void StoredRun::order_as_in_summary(TaskSet& set) const {
  std::ifstream in(folder_ / "summary.json");
  const json summary = json::parse(in, nullptr, false);
  const json::json_pointer tasks("/executors/0/tasks");
  if (!summary.is_object() || !summary.contains(tasks)) return;
  std::map<std::string, std::size_t> place;
  for (const json& task : summary[tasks]) place.emplace(task.value("task", ""), place.size());
  std::stable_sort(set.tasks.begin(), set.tasks.end(),
                   [&](const Task& a, const Task& b) { return place[a.name] < place[b.name]; });
}

void StoredRun::load(const TaskSet& set) {
  tasks_ = read_jobs(&set);
  read_chains();
}

TaskSet StoredRun::read_jobs(const TaskSet* set) {
  const std::filesystem::path file = folder_ / "jobs.csv";
  std::ifstream in(file);
  if (!in) fail("there is no jobs.csv; name the folder of a whole run, made without --no-trace");
  try {
    if (set == nullptr) return read_jobs_csv(in, file.string()).set;
    traces_ = read_jobs_csv(in, *set, file.string());
  } catch (const InputError& error) {
    throw UsageError(option_ + ": " + error.what());
  }
  // Live repetitions are interleaved at random.
  const auto place = [&](const Trace& t) {
    return std::pair(std::find(executors_.begin(), executors_.end(), t.executor), t.repetition);
  };
  std::sort(traces_.begin(), traces_.end(),
            [&](const Trace& a, const Trace& b) { return place(a) < place(b); });
  return *set;
}

void StoredRun::read_chains() {
  const std::filesystem::path file = folder_ / "chains.csv";
  std::ifstream in(file);
  if (!in) fail("there is no chains.csv; name the folder of a whole run");
  for (const ChainRow& row : read_chains_csv(in, file.string())) {
    const auto trace = std::find_if(traces_.begin(), traces_.end(), [&](const Trace& t) {
      return t.executor == row.executor && t.repetition == row.repetition;
    });
    if (trace == traces_.end()) {
      fail("chains.csv has rows of a repetition that jobs.csv does not have; the files are not of one run");
    }
    auto chain = std::find(chains_.begin(), chains_.end(), row.chain);
    if (chain == chains_.end()) chain = chains_.insert(chains_.end(), row.chain);
    ChainRecord& r = trace->chains.emplace_back(row.record);
    r.chain = static_cast<std::uint32_t>(chain - chains_.begin());
  }
}

const Trace& StoredRun::trace(const std::string& executor, std::uint32_t repetition) const {
  const auto found = std::find_if(traces_.begin(), traces_.end(), [&](const Trace& t) {
    return t.executor == executor && t.repetition == repetition;
  });
  if (found == traces_.end()) fail_missing(executor, repetition);
  return *found;
}

std::vector<ExecutorRuns> StoredRun::runs() const {
  std::vector<ExecutorRuns> runs;
  for (const std::string& executor : executors_) runs.push_back({executor, {}});
  for (const Trace& trace : traces_) {
    const auto of = std::find_if(runs.begin(), runs.end(),
                                 [&](const ExecutorRuns& r) { return r.executor == trace.executor; });
    const json* const run = find_run(trace.executor, trace.repetition);
    if (of == runs.end() || run == nullptr) fail_missing(trace.executor, trace.repetition);
    Repetition& repetition = of->repetitions.emplace_back();
    repetition.trace = trace;
    try {
      complete_repetition(*run, tasks_, chains_, repetition);
    } catch (const json::exception& error) {
      fail(std::string("its run.json is not one of `hotpath run`: ") + error.what());
    }
  }
  return runs;
}

SummaryOptions StoredRun::summary_options() const {
  SummaryOptions options;
  options.chains = chains_;
  options.cyclic_timers = cyclic_timers(tasks_);
  options.warm_up = warm_up_;
  options.bootstrap.seed = facts_.value("seed", options.bootstrap.seed);
  return options;
}

void StoredRun::fail(const std::string& what) const {
  throw UsageError(option_ + " " + folder_.string() + ": " + what);
}

void StoredRun::fail_missing(const std::string& executor, std::uint32_t repetition) const {
  std::string list;
  for (const json& run : facts_.at("runs")) list += (list.empty() ? "" : ", ") + named(run);
  fail(named(executor, repetition) + " did not run there; " +
       (list.empty() ? "nothing did" : "there are " + list));
}

json summarize_again(const StoredRun& run) {
  json summary = to_json(summarize(run.tasks(), run.runs(), run.summary_options()));
  const json& runs = run.facts().at("runs");
  if (!runs.empty() && runs.front().contains("expected")) return summary;
  std::ifstream in(run.folder() / "summary.json");
  if (!in) return summary;
  try {
    for (const json& old : json::parse(in).at("executors")) {
      for (json& executor : summary["executors"]) {
        if (executor.at("executor") != old.at("executor")) continue;
        for (const char* key : {"usage", "cpu_per_callback_us", "lost_records", "loss_equations"}) {
          executor[key] = old.at(key);
        }
        for (std::size_t c = 0; c < executor["chains"].size() && c < old.at("chains").size(); ++c) {
          executor["chains"][c]["hot_path_drops"] = old["chains"][c].at("hot_path_drops");
        }
      }
    }
  } catch (const json::exception& error) {
    run.fail(std::string("its summary.json is not one of `hotpath`: ") + error.what());
  }
  return summary;
}

json summarize_golden_trace(const std::filesystem::path& file) {
  const GoldenTrace trace = read_golden_trace(file);
  // The authors' response times refer to next calls alone, not to timestamps.
  const Schedule schedule = schedule_of(trace, false);
  json tasks = json::array();
  for (TaskId id = 0; id < trace.set.size(); ++id) {
    const Task& task = trace.set[id];
    std::vector<double> responses_ms;
    Time next_call = Time{} + task.phase;
    std::uint64_t overruns = 0;
    for (const ExecutedJob& job : schedule.jobs) {
      if (job.task != id) continue;
      const Duration response = response_authors(schedule, job);
      overruns += response > task.deadline;
      responses_ms.push_back(to_ms(response));
      next_call = job.next_call;
    }
    const std::size_t ran = responses_ms.size();
    const auto reached = static_cast<std::size_t>((next_call - Time{} - task.phase) / task.period);
    tasks.push_back({{"task", task.name},
                     {"reached", reached},
                     {"ran", ran},
                     {"skipped", reached - ran},
                     {"deadline_overruns", overruns},
                     {"response_authors_ms", quantiles_json(quantiles(std::move(responses_ms)))}});
  }
  return {{"tasks", tasks}};
}

void write_responses_csv(std::ostream& out, const StoredRun& run) {
  const Time counted_from = Time{} + run.warm_up();
  out << "executor,repetition,task,response_ns\n";
  for (const Trace& trace : run.traces()) {
    for (const JobRecord& r : trace.jobs) {
      if (!counts(r, counted_from)) continue;
      out << trace.executor << ',' << trace.repetition << ',' << run.tasks()[r.job.task].name << ','
          << response_time(r).count() << '\n';
    }
  }
}

}  // namespace hotpath
