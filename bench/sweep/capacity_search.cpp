// SPDX-License-Identifier: Apache-2.0
#include "sweep/capacity_search.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <sstream>

#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "program/whole_file.hpp"
#include "setup/deployed_system.hpp"
#include "setup/limits.hpp"
#include "setup/run_setup.hpp"
#include "sweep/capacity.hpp"
#include "sweep/child_run.hpp"
#include "sweep/rows.hpp"

namespace hotpath::sweep {

namespace {

namespace fs = std::filesystem;

void set_level(setup::CommonOptions& options, Over over, double level) {
  switch (over) {
    case Over::load:
      options.load_percent = level;
      break;
    case Over::rate:
      options.rate_percent = level;
      break;
    case Over::copies:
      options.copies = static_cast<unsigned>(level);
  }
}

/// The limits of the option --load, --rate or --copies.
setup::Limits limits_of(Over over) {
  return over == Over::load ? setup::kLoads : over == Over::rate ? setup::kRates : setup::kCopies;
}

/// A level in all its digits (Levels::at()).
std::string exact(double level) { return program::text("%.12g", level); }

/// What a tried level measured, for figures.
struct Measured {
  results::LatencySummary latency;  ///< Hot-path latency of the chain with the largest one.
  MeasuredRow row;                  ///< Of any chain: losses and deadlines of the executor.
};

/// The columns of text_of().
constexpr const char* kMeasuredOfLevel =
    "p99_ms,p99_low_ms,p99_high_ms,worst_ms,worst_low_ms,worst_high_ms,lost,deadline_overruns,response_share_"
    "max";

std::string text_of(const Measured& m) {
  std::string text;
  const auto add = [&](const std::optional<double>& value) {
    text += value && std::isfinite(*value) ? program::text(",%.6f", *value) : ",";
  };
  const auto with_interval = [&](double value, const std::optional<Interval>& interval) {
    add(value);
    add(interval ? std::optional(interval->low) : std::nullopt);
    add(interval ? std::optional(interval->high) : std::nullopt);
  };
  with_interval(m.latency.quantiles.p99, m.latency.p99);
  with_interval(m.latency.quantiles.max, m.latency.max);
  text += program::concat(",", m.row.lost(), ",", m.row.deadline_overruns);
  add(m.row.response_share_max);
  return text;
}

/// The result for an executor or deployment.
struct Row {
  std::string label;
  std::map<double, Measured> levels;  ///< By level; without those whose run failed.
  Capacity measured;
  std::optional<Capacity> analysed;  ///< nullopt: no method bounds it.
};

class CapacitySearch {
 public:
  explicit CapacitySearch(const CapacityOptions& options)
      : options_(options),
        required_(Requirement::parse(options.require)),
        levels_{options.from, options.to, options.resolution} {
    if (!(options.from <= options.to)) throw program::UsageError("--from is greater than --to");
    if (levels_.count() > 1'000'000) {
      throw program::UsageError("--resolution: more than 1000000 levels; take a larger step");
    }
    const auto whole = [](double v) { return v == std::round(v) && v >= 1; };
    if (options.over == Over::copies &&
        !(whole(options.from) && whole(options.to) && whole(options.resolution))) {
      throw program::UsageError("--over copies: --from, --to and --resolution must be whole numbers from 1");
    }
    const std::string over = to_string(options.over);
    const setup::Limits limits = limits_of(options.over);
    if (options.from < limits.least || options.to > limits.most) {
      throw program::UsageError(program::concat("--over ", over,
                                                ": --from and --to must be in the range of --", over, ", ",
                                                limits.least, " to ", limits.most));
    }
    if (options.repetitions < 2) {
      std::cerr << "note: a single repetition gives no confidence; use --repetitions 20, for example\n";
    }
  }

  void run() {
    folder_ = setup::output_folder(options_.output, "capacity");
    program::check_output_folder(folder_);
    check();
    for (const std::string& name : options_.executors) search(name, false);
    for (const std::string& name : options_.deployments) search(name, true);
    write();
  }

 private:
  /// Rejects wrong use before the search, which would otherwise take it for a failing level.
  void check() const {
    for (const double level : {levels_.low, levels_.at(levels_.count() - 1)}) {
      simulated::Options all = options_;
      set_level(all, options_.over, level);
      const Graph graph = setup::graph_to_run(all);
      [[maybe_unused]] const auto executors = setup::executors_to_run(all, graph, make_tasks(graph));
      if (options_.live) continue;  // the run of the first level checks its options
      for (const std::string& name : options_.executors) simulated::check_simulation(one(name, false, level));
      for (const std::string& name : options_.deployments)
        simulated::check_simulation(one(name, true, level));
    }
  }

  simulated::Options one(const std::string& name, bool deployment, double level) const {
    simulated::Options options = options_;
    options.executors.clear();
    options.deployments.clear();
    (deployment ? options.deployments : options.executors).push_back(name);
    set_level(options, options_.over, level);
    return options;
  }

  void search(const std::string& name, bool deployment) {
    const simulated::Options first = one(name, deployment, levels_.low);
    const Graph graph = setup::graph_to_run(first);
    const std::string label = setup::executors_to_run(first, graph, make_tasks(graph)).front().label;
    std::map<double, Measured> measured;
    const auto failure = [&](double level) {
      std::cerr << label << ": " << to_string(options_.over) << " " << exact(level) << std::flush;
      std::string why;
      try {
        const results::Summary summary = measure(one(name, deployment, level));
        const results::ExecutorSummary& executor = summary.executors.front();
        why = required_.failure(executor);
        measured[level] = Measured{slowest(executor), measured_rows(summary).front()};
      } catch (const program::OverloadError& error) {
        why = error.what();
      } catch (const program::RunError& error) {
        why = error.what();
      }
      std::cerr << (why.empty() ? " holds" : ": " + why) << "\n";
      return why;
    };
    Capacity found = find_capacity(levels_, options_.coarse, failure);
    rows_.push_back({label, std::move(measured), std::move(found), std::nullopt});
    if (!deployment) rows_.back().analysed = analyse(name);
  }

  /// Of the chain with the largest hot-path latency; empty quantiles without chains.
  static results::LatencySummary slowest(const results::ExecutorSummary& executor) {
    results::LatencySummary most;
    for (const results::ChainSummary& chain : executor.chains) {
      const Quantiles& q = chain.hot_path.quantiles;
      if (q.n > 0 && !(q.max <= most.quantiles.max)) most = chain.hot_path;
    }
    return most;
  }

  results::Summary measure(const simulated::Options& options) const {
    if (!options_.live) return simulated::summary_of_simulation(options);
    const fs::path folder = folder_ / "level";
    fs::remove_all(folder);
    std::vector<std::string> words = {"run", "--output=" + folder.string()};
    words.insert(words.end(), options_.run_words.begin(), options_.run_words.end());
    words.push_back(program::concat("--duration=", options.duration_s));
    words.push_back(program::concat("--repetitions=", options.repetitions));
    const bool deployed = !options.deployments.empty();
    words.push_back(deployed ? "--deployments=" + options.deployments[0]
                             : "--executors=" + options.executors[0]);
    const double level = options_.over == Over::load   ? *options.load_percent
                         : options_.over == Over::rate ? *options.rate_percent
                                                       : options.copies;
    words.push_back(program::concat("--", to_string(options_.over), "=", exact(level)));
    run_hotpath(words);
    results::Summary summary = summary_of_folder(folder);
    fs::remove_all(folder);
    return summary;
  }

  /// The largest level at which the bounds meet the deadlines and the required hot-path latency.
  /// Sample losses are not considered: no method bounds them.
  std::optional<Capacity> analyse(const std::string& name) const {
    bool any = false;
    const auto failure = [&](double level) {
      const simulated::Options options = one(name, false, level);
      Graph graph = setup::graph_to_run(options);
      options.apply_to(graph.platform);
      const GraphTasks tasks = make_tasks(graph);
      const setup::ExecutorSpec spec = setup::executors_to_run(options, graph, tasks).front();
      const auto guaranteed = setup::guarantees(graph, tasks, spec);
      any = any || guaranteed;
      return guaranteed ? failure_of(*guaranteed, tasks.set, graph) : "no method covers it";
    };
    const Capacity capacity = find_capacity(levels_, options_.coarse, failure);
    return any ? std::optional(capacity) : std::nullopt;
  }

  std::string failure_of(const bounds::Guarantees& guaranteed, const TaskSet& set, const Graph& graph) const {
    for (TaskId id = 0; id < set.size(); ++id) {
      const auto& bound = guaranteed.tasks[id];
      if (set[id].kind != TaskKind::timer || (bound && Duration(bound->ns) <= set[id].deadline)) continue;
      return "no bound of " + set[id].name + " within its deadline";
    }
    for (std::size_t c = 0; required_.latency_ms && c < graph.chains.size(); ++c) {
      const bounds::ChainGuarantee* chain = guaranteed.chain(graph.chains[c].name);
      const bool bounded = chain != nullptr && chain->hot_path;
      if (!bounded || to_ms(Duration(chain->hot_path->ns)) > *required_.latency_ms)
        return "no bound of " + graph.chains[c].name + " within the latency";
    }
    return "";
  }

  std::string level_text(std::optional<std::size_t> level) const {
    return level ? exact(levels_.at(*level)) : "-";
  }

  std::vector<std::string> cells(const Row& row) const {
    const Capacity& m = row.measured;
    const auto fails = std::ranges::find_if(m.tried, [](const auto& t) { return !t.second.empty(); });
    const bool failed = fails != m.tried.end();
    std::vector<std::string> again;
    for (const std::size_t level : m.again()) again.push_back(level_text(level));
    const bool is_highest_level = m.highest == levels_.count() - 1;
    return {row.label,
            (is_highest_level ? ">= " : "") + level_text(m.highest),
            row.analysed ? level_text(row.analysed->highest) : "no method",
            failed ? level_text(fails->first) : "-",
            failed ? fails->second : "",
            program::joined(again, " ")};
  }

  /// A level counts only if all repetitions hold. With 95 % confidence, at least this share of all
  /// repetitions would hold.
  std::string confidence() const {
    return program::text(
        "%u of %u repetitions of %g s must hold: with 95 %% confidence %.1f %% of all such runs do.",
        options_.repetitions, options_.repetitions, options_.duration_s,
        100 * std::pow(0.05, 1.0 / options_.repetitions));
  }

  void write() const {
    const std::string over = to_string(options_.over);
    const std::vector<std::string> header = {"executor", "largest " + over, "analysis", "fails at",
                                             "why",      "holds again at"};
    program::TextTable table(program::concat(options_.graph, ", ", options_.live ? "live" : "simulated",
                                             ": largest ", over, " with ", program::joined(options_.require),
                                             " (steps of ", exact(options_.resolution), ")"),
                             header);
    std::string page =
        "| " + program::joined(header, " | ") + " |\n| --- | ---: | ---: | ---: | --- | --- |\n";
    for (const Row& row : rows_) {
      const std::vector<std::string> texts = cells(row);
      table.add_row({texts.begin(), texts.end()});
      page += "|";
      for (const std::string& cell : texts) page += " " + program::markdown(cell) + " |";
      page += "\n";
    }
    std::cout << table << "\n" << confidence() << "\n";
    program::create_folder(folder_);
    program::write_whole_file(folder_ / "capacity.md", page + "\n" + confidence() + "\n");
    std::ostringstream levels;
    levels << "executor,source," << over << ",holds,capacity,why," << kMeasuredOfLevel << "\n";
    for (const Row& row : rows_) {
      write_levels(levels, row, options_.live ? "live" : "simulated", row.measured);
      if (row.analysed) write_levels(levels, row, "analysis", *row.analysed);
    }
    program::write_whole_file(folder_ / "levels.csv", levels.str());
    program::show_rows(levels.str());
    program::draw_figure("capacity", folder_);
    std::cout << "\nResults: " << folder_.string() << "\n";
  }

  void write_levels(std::ostream& out, const Row& row, const char* source, const Capacity& c) const {
    for (const auto& [level, why] : c.tried) {
      const auto measured = row.levels.find(levels_.at(level));
      const bool has = &c == &row.measured && measured != row.levels.end();
      out << program::csv_field(row.label) << "," << source << "," << exact(levels_.at(level)) << ","
          << (why.empty() ? 1 : 0) << "," << (level == c.highest ? 1 : 0) << "," << program::csv_field(why)
          << (has ? text_of(measured->second) : ",,,,,,,,,") << "\n";
    }
  }

  const CapacityOptions options_;
  const Requirement required_;
  const Levels levels_;
  fs::path folder_;
  std::vector<Row> rows_;
};

}  // namespace

void search_capacities(const CapacityOptions& options) { CapacitySearch(options).run(); }

}  // namespace hotpath::sweep
