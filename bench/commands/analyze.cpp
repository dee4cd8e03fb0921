// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "bounds/bounds.hpp"
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/analysis/tightness.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#include "results/measures.hpp"
#include "results/stored_run.hpp"

namespace hotpath {

namespace {

struct AnalyzeOptions : CommonOptions, PlatformOptions {
  std::string trace, csv, page, phases_of;
  std::optional<Phases> known_phases;
  std::vector<std::string> chain;
  std::optional<double> delta_us;
  bool strict = false, exact = false;
};

std::string in_ms(std::optional<std::int64_t> ns) { return ns ? fixed(to_ms(Duration(*ns)), 3) : "-"; }

/// The response times and end-to-end latencies of a run, by kind (`task` or `chain`), executor and name.
class Observed {
 public:
  /// Throws UsageError, which names `--trace`, for what is not the folder of a run of these tasks.
  Observed(StoredRun& run, const TaskSet& set) {
    run.load(set);
    for (const Trace& trace : run.traces()) {
      for (const JobRecord& r : trace.jobs) {
        if (r.outcome == Outcome::ran) keep({"task", trace.executor, set[r.job.task].name}, response_time(r));
      }
      for (const ChainRecord& c : trace.chains) {
        if (c.end_to_end_latency < Duration::zero()) continue;  // unknown
        keep({"chain", trace.executor, run.chains()[c.chain]}, c.end_to_end_latency);
      }
    }
  }

  /// In no order.
  const std::vector<std::int64_t>& of(const std::array<std::string, 3>& key) const {
    static const std::vector<std::int64_t> none;
    const auto found = values_.find(key);
    return found == values_.end() ? none : found->second;
  }

 private:
  void keep(const std::array<std::string, 3>& key, Duration value) { values_[key].push_back(value.count()); }

  std::map<std::array<std::string, 3>, std::vector<std::int64_t>> values_;
};

/// The bounds of a graph's tasks and chains, beside what a run observed, if there is one.
class BoundReport {
 public:
  /// Tasks must outlive it.
  BoundReport(const TaskSet& set, const std::optional<Observed>& observed) : set_(set), observed_(observed) {}

  /// To standard output.
  void print(const std::string& executor, const CallbackGraph& graph, const GraphBounds& bounds) {
    std::cout << "\n" << executor << ", " << bounds.method << "\n";
    TextTable tasks = table("task", {"deadline"});
    for (TaskId id = 0; id < set_.size(); ++id) {
      const bool timer = set_[id].kind == TaskKind::timer;
      Row row{{"task", executor, set_[id].name}, bounds.method, bounds.tasks[id]};
      if (timer) row.deadline = set_[id].deadline.count();
      add_row(tasks, row, {timer ? in_ms(row.deadline) : ""});
    }
    std::cout << tasks;
    print_verdict(bounds);
    if (bounds.chains.empty()) return;
    TextTable chains = table("chain, end to end", {"response", "waiting", "last timer"});
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      const std::optional<ChainAge>& age = bounds.chains[c];
      std::vector<std::string> parts = {"-", "-", bounds.no_chain_bound[c]};
      Row row{{"chain", executor, graph.chains[c].name}, bounds.method};
      if (age) {
        parts = {in_ms(age->response), in_ms(age->waiting), set_[age->last_timer].name};
        row.bound = age->latency;
        row.response = age->response;
        row.waiting = age->waiting;
        row.dominated_by = dominated_by(*age);
      }
      add_row(chains, row, parts);
    }
    std::cout << chains;
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      if (bounds.chains[c])
        std::cout << graph.chains[c].name << ": " << dominated_by(*bounds.chains[c]) << "\n";
    }
  }

  std::size_t violations() const { return violations_; }  ///< Observed values beyond a bound.
  std::size_t compared() const { return compared_; }      ///< Observed values with a bound.
  const std::string& first_violation() const { return first_violation_; }
  /// Every row so far.
  std::string csv() const {
    return "executor,method,kind,name,bound_ns,observed_ns,tightness,violated,deadline_ns,response_ns,"
           "waiting_ns,"
           "dominated_by\n" +
           csv_.str();
  }

 private:
  TextTable table(const std::string& what, std::vector<std::string> more) const {
    std::vector<std::string> header = {what, "bound ms"};
    header.insert(header.end(), more.begin(), more.end());
    if (observed_) header.insert(header.end(), {"observed ms", "tightness", ""});
    return TextTable("", std::move(header));
  }

  /// What to change for a smaller bound.
  std::string dominated_by(const ChainAge& age) const {
    constexpr std::size_t kMost = 5;
    const auto part = [](std::int64_t ns, const std::string& what) { return in_ms(ns) + " " + what; };
    std::string out;
    if (age.waited_at != kNoTask) out = part(age.waiting, "ms waiting at " + set_[age.waited_at].name + "; ");
    out += part(age.response, "ms behind " + set_[age.last_timer].name + "'s timestamp: ");
    if (age.parts.blocking > 0) {
      const bool job = age.parts.blocker != kNoTask;
      out +=
          part(age.parts.blocking, job ? "blocked by " + set_[age.parts.blocker].name + "; " : "waking up; ");
    }
    for (std::size_t i = 0; i < std::min(kMost, age.parts.work.size()); ++i) {
      out += (i > 0 ? "; " : "") + part(age.parts.work[i].second, set_[age.parts.work[i].first].name);
    }
    return out + (age.parts.work.size() > kMost ? "; ..." : "");
  }

  struct Row {
    std::array<std::string, 3> key;  ///< Kind, executor, name.
    std::string method;
    std::optional<std::int64_t> bound{}, deadline{}, response{}, waiting{};
    std::string dominated_by{};
  };

  void add_row(TextTable& rows, const Row& row, const std::vector<std::string>& more) {
    const auto& [key, method, bound, deadline, response, waiting, dominated] = row;
    std::vector<TextTable::Cell> cells = {key[2], in_ms(bound)};
    cells.insert(cells.end(), more.begin(), more.end());
    Tightness t{key[2], bound, std::nullopt, std::nullopt, false};
    if (observed_) {
      const std::vector<std::int64_t>& values = observed_->of(key);
      if (!values.empty()) t.observed = std::ranges::max(values);
      if (bound && *bound > 0) t = compare_with_bounds({{t.name, bound, t.observed}}).rows.front();
      t.violated = bound && t.observed.value_or(0) > *bound;
      count(values, key, method, bound);
      cells.insert(cells.end(),
                   {in_ms(t.observed), t.ratio ? fixed(*t.ratio, 3) : "-", t.violated ? "VIOLATED" : ""});
    }
    rows.add_row(std::move(cells));
    write_row(csv_, key[1], method, key[0], t.name, t.bound, t.observed, t.ratio, t.violated ? "yes" : "no",
              deadline, response, waiting, dominated);
  }

  void count(const std::vector<std::int64_t>& values, const std::array<std::string, 3>& key,
             const std::string& method, std::optional<std::int64_t> bound) {
    if (!bound) return;
    compared_ += values.size();
    const auto beyond = static_cast<std::size_t>(
        std::ranges::count_if(values, [&](std::int64_t value) { return value > *bound; }));
    if (violations_ == 0 && beyond > 0) {
      first_violation_ = key[0] + " " + key[2] + " under " + key[1] + " by " + method;
    }
    violations_ += beyond;
  }

  void print_verdict(const GraphBounds& bounds) const {
    for (TaskId id = 0; id < set_.size(); ++id) {
      const bool timer = set_[id].kind == TaskKind::timer;
      if (!timer || (bounds.tasks[id] && *bounds.tasks[id] <= set_[id].deadline.count())) continue;
      std::cout << "Not shown schedulable: " << set_[id].name << " may exceed its deadline.\n";
      return;
    }
    std::cout << "Schedulable: every timer meets its deadline.\n";
  }

  const TaskSet& set_;
  const std::optional<Observed>& observed_;
  std::ostringstream csv_;
  std::size_t violations_ = 0, compared_ = 0;
  std::string first_violation_;
};

class Analysis {
 public:
  explicit Analysis(const AnalyzeOptions& options) : options_(options) {
    if (!options.trace.empty()) {
      trace_.emplace(options.trace, "--trace");
      take_over_run();
    }
    graph_ = graph_to_run(options_);
    const GraphPlatform of_graph = graph_.platform;
    options_.apply_to(graph_.platform);
    if (options.delta_us) graph_.platform.release_cost = from_ms(*options.delta_us / 1000);
    if (simulated()) {
      if (platform_json(graph_.platform) != platform_json(of_graph)) {
        throw UsageError(
            "--trace: its bounds are for the machine of that simulation; leave out the options that change "
            "it");
      }
      trace_->check([&] { graph_.platform = platform_from_json(trace_->facts().at("platform")); });
    }
    tasks_ = make_tasks(graph_);
    try {
      callback_graph(graph_, tasks_, false);
    } catch (const AnalysisError& error) {
      throw UsageError("analyze " + options_.graph + ": " + error.what() + "; simulate the graph instead");
    }
    if (trace_) observed_.emplace(*trace_, tasks_.set);
  }

  void run() {
    std::printf("%s: load %.1f %% of one core, %s\n", graph_.name.c_str(), load_percent(graph_),
                costs_text().c_str());
    BoundReport report(tasks_.set, observed_);
    for (const ExecutorSpec& executor : executors_to_run(options_, graph_, tasks_)) {
      options_.chain.empty() ? bound(executor, report) : bound_chain(executor);
    }
    if (!options_.csv.empty()) write_whole_file(options_.csv, "--csv", report.csv());
    if (report.violations() > 0) judge(report);
    if (!options_.page.empty()) write_page(report);
  }

 private:
  /// A bound is compared with what ran: same load, rule, ties and simulated machine.
  void take_over_run() {
    const nlohmann::json& facts = trace_->facts();
    trace_->check([&] {
      const nlohmann::json load = facts.value("load_given", nlohmann::json());
      if (!options_.load_percent && load.is_number()) options_.load_percent = load.get<double>();
      options_.rule = *parse<SubscriptionRule>(facts.at("rule").get<std::string>());
      options_.ties = *parse<Ties>(facts.at("ties").get<std::string>());
    });
  }

  bool simulated() const { return trace_ && trace_->facts().value("kind", "") == "simulated"; }

  std::string costs_text() const {
    std::string text;
    for (const PlatformCost& cost : kPlatformCosts) {
      const Duration value = graph_.platform.*cost.value;
      if (value > Duration::zero())
        text += (text.empty() ? "" : ", ") + std::string(cost.key) + " " + fixed(to_us(value), 3);
    }
    return text.empty() ? "no costs" : text;
  }

  CallbackGraph callbacks_of(const ExecutorSpec& executor) {
    GraphTasks tasks = tasks_;
    bool known = true;
    if (!options_.phases_of.empty()) {
      const StoredRun run(options_.phases_of, "--phases-of");
      set_phases(tasks.set, run.first_timestamps(tasks.set, executor.label, 0));
    } else if (options_.known_phases) {
      options_.phases = *options_.known_phases;
      set_phases(tasks.set, phases_of_repetition(options_, graph_, tasks, executor, 0));
    } else {
      known = false;
    }
    return callback_graph(graph_, tasks, known);
  }

  BoundedSystem system_of(const CallbackGraph& callbacks, const ExecutorSpec& executor) const {
    return {callbacks, *executor.entry, executor.scheduler, make_platform(graph_, *executor.entry)};
  }

  void bound(const ExecutorSpec& executor, BoundReport& report) {
    const CallbackGraph callbacks = callbacks_of(executor);
    std::string refusals;
    bool any = false;
    const BoundedSystem system = system_of(callbacks, executor);
    std::vector<GraphBounds> all = graph_bounds(system);
    if (options_.exact) all.push_back(exact_bounds(system));
    for (const GraphBounds& bounds : all) {
      if (!bounds.refusal.empty()) {
        refusals += "  " + bounds.method + ": " + bounds.refusal + "\n";
        refused_.push_back(
            {{"executor", executor.label}, {"method", bounds.method}, {"why", bounds.refusal}});
        continue;
      }
      report.print(executor.label, callbacks, bounds);
      any = true;
    }
    if (any) {
      std::cout << "Not applied to " << executor.label << ":\n" << refusals;
    } else {
      std::cout << "\n" << executor.label << ": no bound is known\n" << refusals;
    }
  }

  void bound_chain(const ExecutorSpec& executor) {
    const CallbackGraph callbacks = callbacks_of(executor);
    TextTable table(
        executor.label + ", chain " + joined(options_.chain, " -> ") + ": largest reaction time and data age",
        {"method", "ms", ""});
    for (const TimerChainBound& b : timer_chain_bounds(system_of(callbacks, executor), options_.chain)) {
      table.add_row({b.method, in_ms(b.latency), b.refusal});
    }
    std::cout << "\n" << table;
    if (table.empty()) std::cout << "no published bound covers this executor\n";
  }

  /// What the page is made from, then the page.
  [[noreturn]] void write_page(const BoundReport& report) const {
    const std::filesystem::path folder = options_.page;
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    const nlohmann::json facts = {{"graph", graph_.name},
                                  {"load_percent", load_percent(graph_)},
                                  {"costs", costs_text()},
                                  {"trace", options_.trace},
                                  {"refused", refused_}};
    write_whole_file(folder / "bounds.csv", "--page", report.csv());
    write_whole_file(folder / "bounds.json", "--page", facts.dump(1) + "\n");
    become_python_tool("guarantees", {folder.string()});
  }

  /// Throws RunError where the bound claims to hold and does not.
  void judge(const BoundReport& report) const {
    const std::string share =
        text("%zu of %zu observed values (%.4f %%) exceed their bound, first %s", report.violations(),
             report.compared(),
             100.0 * static_cast<double>(report.violations()) / static_cast<double>(report.compared()),
             report.first_violation().c_str());
    if (simulated()) {
      throw RunError("--trace " + options_.trace + ": " + share + ". A bound is wrong. To reproduce it: " +
                     trace_->facts().value("command", std::string("see run.json")) + ", graph " +
                     options_.graph + "; please report both");
    }
    std::cout << "\n"
              << share
              << ". Bounds assume one processor to itself, no job longer than its execution time and the "
              << "platform's costs; a live run has more than that:\n";
    for (const auto& warning : trace_->facts().value("warnings", nlohmann::json::array())) {
      std::cout << "  " << warning.get<std::string>() << "\n";
    }
    if (options_.strict) throw RunError("--strict: " + share);
  }

  AnalyzeOptions options_;
  std::optional<StoredRun> trace_;
  Graph graph_;
  GraphTasks tasks_;
  std::optional<Observed> observed_;
  nlohmann::json refused_ = nlohmann::json::array();
};

}  // namespace

void add_analyze_command(CLI::App& app) {
  auto [command, o] = add_command<AnalyzeOptions>(
      app, "analyze", "What theory guarantees: worst-case response times and latencies",
      "hotpath analyze autoware --executors fp-ro,default",
      [](const AnalyzeOptions& options) { Analysis(options).run(); });
  o.executors = {"default", "events-ro", "rm-ro", "edf-ro"};
  command.add_option("GRAPH", o.graph, "Name of a graph (`hotpath list graphs`) or path of a file")
      ->required();
  command
      .add_option("--executors", o.executors, "Names separated by commas, also variants as in rm-ro:first")
      ->delimiter(',')
      ->capture_default_str();
  add_number(command, "--load", o.load_percent, {0, 10000}, "PERCENT",
             "Work of all nodes in percent of one core; by default\nwhat the graph says, or what the run of "
             "--trace had");
  add_choice(command, "--phases", o.known_phases, "Bounds for these phases alone; by default for any");
  add_text(command, "--phases-of", o.phases_of, "RUN",
           "Bounds for the phases of that executor's first repetition");
  command.add_flag("--exact", o.exact,
                   "Also the exact worst case for known phases, of timers and\nsequences of subscriptions");
  auto* trace =
      add_text(command, "--trace", o.trace, "RUN", "Folder of a run of this graph: observed against bound");
  command.add_flag("--strict", o.strict, "Exit code 1 also when a live run exceeds a bound")->needs(trace);
  command.add_option("--chain", o.chain, "Timers separated by commas: bounds of the chain they form")
      ->delimiter(',')
      ->excludes(trace);
  command.add_option("--csv", o.csv, "Also write the table to this file");
  add_text(command, "--page", o.page, "FOLDER", "Also write a page with pictures into this folder");
  add_platform_options(command, o);
  add_number(command, "--delta-us", o.delta_us, {0, 1e9}, "US", "The same as --release-cost-us");
}

}  // namespace hotpath
