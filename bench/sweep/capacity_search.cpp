// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "program/errors.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/deployed_system.hpp"
#include "sweep/capacity.hpp"
#include "sweep/rows.hpp"

namespace hotpath::sweep {

namespace {

/// Levels that a search tries before it bisects.
constexpr std::size_t kCoarse = 12;
/// A level in all its digits (Levels::at()).
constexpr const char* kLevelFormat = "%.12g";
std::string exact(double level) { return program::text(kLevelFormat, level); }

/// A level that a source has tried; the analysis measures nothing.
struct LevelRow {
  std::string executor, source;
  double level = 0;
  bool is_capacity = false;
  std::optional<std::string> why;         ///< Why the requirement does not hold.
  results::LatencySummary age, hot_path;  ///< Each of the chain with the largest one.
  std::optional<std::uint64_t> lost, deadline_overruns;
  std::optional<double> response_share_max;
};

std::vector<program::Column<LevelRow>> level_columns(const std::string& over) {
  constexpr const char* kMeasured = "%.6f";
  std::vector<program::Column<LevelRow>> columns = {
      {"executor", &LevelRow::executor},
      {"source", &LevelRow::source},
      {over, &LevelRow::level, kLevelFormat},
      {"holds", [](const LevelRow& row) { return !row.why; }},
      {"capacity", &LevelRow::is_capacity},
      {"why", &LevelRow::why},
      {"lost", &LevelRow::lost},
      {"deadline_overruns", &LevelRow::deadline_overruns},
      {"response_share_max", &LevelRow::response_share_max, kMeasured}};
  using Latency = results::LatencySummary;
  for (const auto& [latency, of] : {std::pair("age_", &LevelRow::age), {"", &LevelRow::hot_path}}) {
    for (const auto& [name, quantile] : {std::pair("p99_", &Quantiles::p99), {"worst_", &Quantiles::max}}) {
      for (const auto& [end, part] :
           {std::pair("ms", &Latency::quantiles), {"low_ms", &Latency::low}, {"high_ms", &Latency::high}}) {
        const auto value = [of = of, quantile = quantile, part = part](const LevelRow& row) {
          return finite(row.*of.*part.*quantile);
        };
        columns.emplace_back(program::concat(latency, name, end), value, kMeasured);
      }
    }
  }
  return columns;
}

void add_measures(const results::ExecutorSummary& executor, LevelRow& row) {
  const auto keep_larger = [](const results::LatencySummary& of, results::LatencySummary& most) {
    if (of.quantiles.n > 0 && !(of.quantiles.max <= most.quantiles.max)) most = of;
  };
  for (const results::ChainSummary& chain : executor.chains) {
    keep_larger(chain.end_to_end, row.age);
    keep_larger(chain.hot_path, row.hot_path);
  }
  row.lost = executor.lost();
  row.deadline_overruns = executor.after_warm_up.deadline_overruns;
  row.response_share_max = MeasuredRow{&executor, nullptr}.response_share_max();
}

/// Why the bounds do not meet the deadlines and the required age and latency; none: they do. Sample
/// losses are not considered: no method bounds them.
std::optional<std::string> failure_of(const bounds::Guarantees& guaranteed, const TaskSet& set,
                                      const Graph& graph, const Requirement& require) {
  for (TaskId id = 0; id < set.size(); ++id) {
    const auto& bound = guaranteed.tasks[id];
    if (set[id].kind != TaskKind::timer || (bound && Duration(bound->ns) <= set[id].deadline)) continue;
    return "no bound of " + set[id].name + " within its deadline";
  }
  for (const Chain& named : graph.chains) {
    const bounds::ChainGuarantee* chain = guaranteed.chain(named.name);
    const auto within = [&](std::optional<bounds::Guarantee> bounds::ChainGuarantee::*of,
                            std::optional<double> limit_ms) {
      return !limit_ms || (chain != nullptr && chain->*of && to_ms(Duration((chain->*of)->ns)) <= *limit_ms);
    };
    if (!within(&bounds::ChainGuarantee::age, require.age_ms))
      return "no bound of " + named.name + " within the age";
    if (!within(&bounds::ChainGuarantee::hot_path, require.latency_ms))
      return "no bound of " + named.name + " within the latency";
  }
  return std::nullopt;
}

/// The limits of the option --load, --rate or --copies.
setup::Limits limits_of(Over over) {
  return over == Over::load ? setup::kLoads : over == Over::rate ? setup::kRates : setup::kCopies;
}

class CapacitySearch {
 public:
  explicit CapacitySearch(const CapacityOptions& options)
      : options_(options),
        over_(to_string(options.over)),
        levels_{options.from, options.to, options.resolution},
        found_(program::concat(options.graph, ", simulated: largest ", over_, " with ",
                               program::joined(options.require.words), " (steps of ",
                               exact(options.resolution), ")"),
               {"executor", "largest " + over_, "analysis", "fails at", "why", "holds again at"}) {
    if (!(options.from <= options.to)) throw program::UsageError("--from is greater than --to");
    if (levels_.count() > 1'000'000) {
      throw program::UsageError("--resolution: more than 1000000 levels; take a larger step");
    }
    const auto whole = [](double v) { return v == std::round(v) && v >= 1; };
    if (options.over == Over::copies &&
        !(whole(options.from) && whole(options.to) && whole(options.resolution))) {
      throw program::UsageError("--over copies: --from, --to and --resolution must be whole numbers from 1");
    }
    const setup::Limits limits = limits_of(options.over);
    if (options.from < limits.least || options.to > limits.most) {
      throw program::UsageError(program::concat("--over ", over_,
                                                ": --from and --to must be in the range of --", over_, ", ",
                                                limits.least, " to ", limits.most));
    }
    if (options.repetitions < 2) {
      std::cerr << "note: a single repetition gives no confidence; use --repetitions 20, for example\n";
    }
  }

  void run() {
    const std::filesystem::path folder = setup::output_folder(options_.output, "capacity");
    program::check_output_folder(folder);
    check();
    for (const simulated::Options& one : each_at(levels_.low)) search(one);
    write(folder);
  }

 private:
  /// The options of each executor, then of each deployment, at a level.
  std::vector<simulated::Options> each_at(double level) const {
    simulated::Options none = at(options_, level);
    none.executors.clear();
    none.deployments.clear();
    std::vector<simulated::Options> each;
    for (const std::string& name : options_.executors) each.emplace_back(none).executors = {name};
    for (const std::string& name : options_.deployments) each.emplace_back(none).deployments = {name};
    return each;
  }

  simulated::Options at(simulated::Options options, double level) const {
    if (options_.over == Over::load) options.load_given = level;
    if (options_.over == Over::rate) options.rate_percent = level;
    if (options_.over == Over::copies) options.copies = static_cast<unsigned>(level);
    return options;
  }

  /// Rejects wrong use before the search, which would otherwise take it for a failing level.
  void check() const {
    for (const double level : {levels_.low, levels_.at(levels_.count() - 1)}) {
      const simulated::Options all = at(options_, level);
      const Graph graph = setup::graph_to_run(all);
      [[maybe_unused]] const auto executors = setup::executors_to_run(all, graph, make_tasks(graph));
      for (const simulated::Options& one : each_at(level)) simulated::check_simulation(one);
    }
  }

  /// Adds what an executor or deployment carries to the tables.
  void search(const simulated::Options& one) {
    const Graph graph = setup::graph_to_run(one);
    const std::string label = setup::executors_to_run(one, graph, make_tasks(graph)).front().label;
    const auto text = [&](std::optional<std::size_t> level) {
      return level ? exact(levels_.at(*level)) : std::string("-");
    };
    const Capacity c = tried(label, "simulated", [&](LevelRow& row) {
      std::cerr << label << ": " << over_ << " " << exact(row.level) << std::flush;
      try {
        const results::Summary summary = simulated::summary_of_simulation(at(one, row.level));
        row.why = options_.require.failure(summary.executors.front());
        add_measures(summary.executors.front(), row);
      } catch (const program::OverloadError& error) {
        row.why = error.what();
      }
      std::cerr << (row.why ? ": " + *row.why : " holds") << "\n";
    });
    const auto fails = std::ranges::find_if(c.tried, [](const auto& t) { return t.second.has_value(); });
    const bool failed = fails != c.tried.end();
    std::vector<std::string> again;
    for (const std::size_t level : c.again()) again.push_back(text(level));
    const std::optional<Capacity> analysed = analyse(one, label);
    found_.add_row({label, (c.highest == levels_.count() - 1 ? ">= " : "") + text(c.highest),
                    analysed ? text(analysed->highest) : "no method", failed ? text(fails->first) : "-",
                    failed ? *fails->second : "", program::joined(again, " ")});
  }

  /// The largest level at which the bounds meet the requirement; nullopt: no method bounds it.
  std::optional<Capacity> analyse(const simulated::Options& one, const std::string& label) {
    if (!one.deployments.empty()) return std::nullopt;
    bool any = false;
    const std::size_t before = rows_.size();
    Capacity capacity = tried(label, "analysis", [&](LevelRow& row) {
      const simulated::Options options = at(one, row.level);
      Graph graph = setup::graph_to_run(options);
      options.apply_to(graph.platform);
      const GraphTasks tasks = make_tasks(graph);
      const setup::ExecutorSpec spec = setup::executors_to_run(options, graph, tasks).front();
      const auto guaranteed = setup::guarantees(graph, tasks, spec);
      any = any || guaranteed;
      row.why =
          guaranteed ? failure_of(*guaranteed, tasks.set, graph, options_.require) : "no method covers it";
    });
    if (any) return capacity;
    rows_.resize(before);
    return std::nullopt;
  }

  /// Searches with `try_level`, which fills a row and says why the level fails, and adds all rows.
  Capacity tried(const std::string& label, const char* source,
                 const std::function<void(LevelRow&)>& try_level) {
    std::map<double, LevelRow> rows;
    Capacity capacity = find_capacity(levels_, kCoarse, [&](double level) {
      LevelRow& row = rows[level];
      row.executor = label;
      row.source = source;
      row.level = level;
      try_level(row);
      return row.why;
    });
    if (capacity.highest) rows[levels_.at(*capacity.highest)].is_capacity = true;
    for (const auto& [level, row] : rows) rows_.push_back(row);
    return capacity;
  }

  /// A level counts only if all repetitions hold. With 95 % confidence, at least this share of all
  /// repetitions would hold.
  std::string confidence() const {
    return program::text(
        "%u of %u repetitions of %g s must hold: with 95 %% confidence %.1f %% of all such runs do.",
        options_.repetitions, options_.repetitions, options_.duration_s,
        100 * std::pow(0.05, 1.0 / options_.repetitions));
  }

  void write(const std::filesystem::path& folder) const {
    std::cout << found_ << "\n" << confidence() << "\n";
    program::create_folder(folder);
    const std::string page = markdown_of(found_, {1, 2, 3}) + "\n" + confidence() + "\n";
    program::write_whole_file(folder / "capacity.md", page);
    const program::Table levels = program::table_of(level_columns(over_), rows_);
    program::write_whole_file(folder / "levels.csv", csv_of(levels));
    program::show_json(json_of(levels));
    program::draw_figure("capacity", folder);
    std::cout << "\nResults: " << folder.string() << "\n";
  }

  const CapacityOptions options_;
  const std::string over_;
  const Levels levels_;
  program::Table found_;  ///< What is printed, and stored for a page.
  std::vector<LevelRow> rows_;
};

}  // namespace

void search_capacities(const CapacityOptions& options) { CapacitySearch(options).run(); }

}  // namespace hotpath::sweep
