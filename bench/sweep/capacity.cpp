// SPDX-License-Identifier: Apache-2.0
#include "sweep/capacity.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "bounds/bounds.hpp"
#include "hotpath/core/enum_text.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/measures.hpp"
#include "setup/deployed_system.hpp"
#include "sweep/rows.hpp"

namespace hotpath::sweep {

using program::concat, program::Table;

double Levels::at(std::size_t index) const {
  return std::stod(program::text("%.12g", low + static_cast<double>(index) * step));
}

std::vector<std::size_t> Capacity::again() const {
  std::vector<std::size_t> levels;
  bool failed = false;
  for (const auto& [level, failure] : tried) {
    failed = failed || failure;
    if (failed && !failure) levels.push_back(level);
  }
  return levels;
}

Capacity find_capacity(const Levels& levels, std::size_t coarse,
                       const std::function<std::optional<std::string>(double)>& failure) {
  Capacity capacity;
  const auto holds = [&](std::size_t level) {
    const auto [at, added] = capacity.tried.try_emplace(level);
    if (added) at->second = failure(levels.at(level));
    return !at->second;
  };
  const std::size_t last = levels.count() - 1;
  std::optional<std::size_t> below, above;  // the first level that failed, and the last before it that held
  for (std::size_t i = 0; i < coarse; ++i) {
    const std::size_t level = i * last / (coarse - 1);
    const bool held = holds(level);
    if (!above) (held ? below : above) = level;
  }
  while (below && above && *above - *below > 1) {
    const std::size_t middle = *below + (*above - *below) / 2;
    (holds(middle) ? below : above) = middle;
  }
  capacity.highest = below;
  return capacity;
}

Requirement Requirement::parse(const std::vector<std::string>& words) {
  Requirement r{.words = words};
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find(':') + 1);
    const auto limits = [&](Latency of) { return name == concat(results::words_of(of).limit, ":"); };
    if (word == "no-loss") {
      r.no_loss = true;
    } else if (word == "deadlines") {
      r.deadlines = true;
    } else if (limits(Latency::age) || limits(Latency::hot_path)) {
      const auto limit_ms = hotpath::parse<double>(std::string_view(word).substr(name.size()));
      if (!(limit_ms > 0.0))
        throw program::UsageError(
            concat("--require: `", word, "` has no limit; write ", name, "60 for 60 ms"));
      r.most_ms[limits(Latency::age) ? Latency::age : Latency::hot_path] = *limit_ms;
    } else {
      throw program::UsageError("--require: `" + word + "` is not no-loss, deadlines, age:MS or latency:MS");
    }
  }
  return r;
}

std::optional<std::string> Requirement::failure(const results::ExecutorSummary& executor) const {
  using Each = results::RepetitionMeasures;
  const std::vector<Each>& each = executor.each;
  if (each.empty()) return "nothing was measured";
  std::optional<std::string> first;
  const auto require = [&](auto fails, const std::string& why) {
    const auto count = first ? 0 : std::ranges::count_if(each, fails);
    if (count > 0)
      first = each.size() == 1 ? why : concat(why, " (", count, " of ", each.size(), " repetitions)");
  };
  if (no_loss)
    require([](const Each& r) { return r.lost() > 0; },
            concat(executor.skipped, " timestamps skipped, ", executor.overwritten, " samples overwritten"));
  if (deadlines)
    require([](const Each& r) { return r.deadline_overruns > 0; },
            concat(executor.after_warm_up.deadline_overruns, " deadlines missed"));
  const auto most = [&](auto of) { return of(*std::ranges::max_element(each, {}, of)); };
  const std::uint64_t never_ran = most([](const Each& r) { return r.never_ran; });
  require([](const Each& r) { return r.never_ran > 0; },
          never_ran == 1 ? "a task never ran" : concat(never_ran, " tasks never ran"));
  for (std::size_t c = 0; !most_ms.empty() && c < executor.chains.size(); ++c) {
    require([c](const Each& r) { return r.chains[c].outputs == 0; },
            "no output of chain " + executor.chains[c].chain);
    for (const auto& [latency, limit_ms] : most_ms) {
      const auto of =
          latency == Latency::age ? &Each::OfChain::worst_age_ms : &Each::OfChain::worst_hot_path_ms;
      const auto worst = [c, of](const Each& r) { return r.chains[c].*of; };
      require([worst, limit = limit_ms](const Each& r) { return !(worst(r) <= limit); },
              program::text("%s %.1f ms", results::words_of(latency).limit, most(worst)));
    }
  }
  return first;
}

namespace {

/// Levels that a search tries before it bisects.
constexpr std::size_t kCoarse = 12;
/// A level in all its digits (Levels::at()).
constexpr const char* kLevelFormat = "%.12g";
std::string exact(double level) { return program::text(kLevelFormat, level); }

/// Columns of every tried level, after the reason of a failure.
constexpr const char* kMeasures[] = {"lost",         "deadline_overruns", "response_share_max",
                                     "age_p99_ms",   "age_p99_low_ms",    "age_p99_high_ms",
                                     "age_worst_ms", "age_worst_low_ms",  "age_worst_high_ms",
                                     "p99_ms",       "p99_low_ms",        "p99_high_ms",
                                     "worst_ms",     "worst_low_ms",      "worst_high_ms"};

/// The measures of one level; the age and the hot path are each of the chain with the largest one.
std::vector<program::Value> measures_of(const results::ExecutorSummary& executor) {
  constexpr const char* kDigits = "%.6f";
  std::vector<program::Value> values = {
      executor.lost(), executor.after_warm_up.deadline_overruns, {response_share_max(executor), kDigits}};
  for (const Latency latency : {Latency::age, Latency::hot_path}) {
    const auto worst = [&](const results::ChainSummary& chain) {
      const Quantiles& q = chain.latency(latency).quantiles;
      return q.n > 0 ? q.max : -INFINITY;
    };
    const auto chain = std::ranges::max_element(executor.chains, {}, worst);
    const auto of = chain == executor.chains.end() ? results::LatencySummary() : chain->latency(latency);
    for (const auto quantile : {&Quantiles::p99, &Quantiles::max}) {
      for (const Quantiles& q : {of.quantiles, of.low, of.high})
        values.emplace_back(finite(q.*quantile), kDigits);
    }
  }
  return values;
}

/// Why the bounds do not meet the deadlines and the required age and latency; none: they do. Sample
/// losses are not considered: no method bounds them.
std::optional<std::string> failure_of(const bounds::Guarantees& guaranteed, const TaskSet& set,
                                      const Graph& graph, const Requirement& require) {
  for (const TaskId id : set.timers()) {
    const auto bound = guaranteed.of(Latency::response, set[id].name);
    if (bound && Duration(bound->ns) <= set[id].deadline) continue;
    return "no bound of " + set[id].name + " within its deadline";
  }
  for (const Chain& named : graph.chains)
    for (const auto& [latency, limit_ms] : require.most_ms) {
      const auto bound = guaranteed.of(latency, named.name);
      if (!bound || !(to_ms(Duration(bound->ns)) <= limit_ms))
        return concat("no bound of ", named.name, " within the ", results::words_of(latency).limit);
    }
  return std::nullopt;
}

/// Throws UsageError.
void check_levels(const CapacityOptions& options, const Levels& levels) {
  const auto whole = [](double v) { return v == std::round(v) && v >= 1; };
  if (!(options.from <= options.to)) throw program::UsageError("--from is greater than --to");
  if (levels.count() > 1'000'000)
    throw program::UsageError("--resolution: more than 1000000 levels; take a larger step");
  if (options.over == Over::copies &&
      !(whole(options.from) && whole(options.to) && whole(options.resolution)))
    throw program::UsageError("--over copies: --from, --to and --resolution must be whole numbers from 1");
  const setup::Limits limits = options.over == Over::load   ? setup::kLoads
                               : options.over == Over::rate ? setup::kRates
                                                            : setup::kCopies;
  if (options.from >= limits.least && options.to <= limits.most) return;
  const std::string over = to_string(options.over);
  throw program::UsageError(concat("--over ", over, ": --from and --to must be in the range of --", over,
                                   ", ", limits.least, " to ", limits.most));
}

class CapacitySearch {
 public:
  explicit CapacitySearch(const CapacityOptions& options) : options_(options) {
    check_levels(options, levels_);
    levels_table_.header.insert(levels_table_.header.end(), std::begin(kMeasures), std::end(kMeasures));
    if (options.repetitions < 2)
      std::cerr << "note: a single repetition gives no confidence; use --repetitions 20, for example\n";
  }

  void run() {
    const std::filesystem::path folder = setup::output_folder(options_.output, "capacity");
    program::check_output_folder(folder);
    check();
    program::end_on_interrupt("hotpath: interrupted; the search was stopped, and nothing was stored\n");
    for (const simulated::Options& one : each_at(levels_.low)) search(one);
    program::catch_interrupts();
    write(folder);
  }

 private:
  /// Says why a level fails, and fills in its measures, if there are any.
  using Judge = std::function<std::optional<std::string>(double level, std::vector<program::Value>&)>;

  simulated::Options at(simulated::Options options, double level) const {
    if (options_.over == Over::load) options.load_given = level;
    if (options_.over == Over::rate) options.rate_percent = level;
    if (options_.over == Over::copies) options.copies = static_cast<unsigned>(level);
    return options;
  }

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

  /// Rejects wrong use before the search, which would otherwise take it for a failing level.
  void check() const {
    for (const double level : {levels_.low, levels_.at(levels_.count() - 1)}) {
      const simulated::Options all = at(options_, level);
      const Graph graph = setup::graph_to_run(all);
      (void)setup::executors_to_run(all, graph, make_tasks(graph));
      for (const simulated::Options& one : each_at(level)) simulated::check_simulation(one);
    }
  }

  std::string shown(std::optional<std::size_t> level) const {
    return level ? exact(levels_.at(*level)) : "-";
  }

  /// Adds what an executor or deployment carries to the tables.
  void search(const simulated::Options& one) {
    const Graph graph = setup::graph_to_run(one);
    const std::string label = setup::executors_to_run(one, graph, make_tasks(graph)).front().label;
    const Capacity c = tried(label, "simulated", [&](double level, std::vector<program::Value>& measures) {
      std::optional<std::string> why;
      std::cerr << label << ": " << over_ << " " << exact(level) << std::flush;
      try {
        const results::Summary summary = simulated::summary_of_simulation(at(one, level));
        why = options_.require.failure(summary.executors.front());
        measures = measures_of(summary.executors.front());
      } catch (const program::OverloadError& error) {
        why = error.what();
      }
      std::cerr << (why ? ": " + *why : " holds") << "\n";
      return why;
    });
    const auto fails = std::ranges::find_if(c.tried, [](const auto& t) { return t.second.has_value(); });
    const bool failed = fails != c.tried.end();
    std::vector<std::string> again;
    for (const std::size_t level : c.again()) again.push_back(shown(level));
    found_.add_row({label, (c.highest == levels_.count() - 1 ? ">= " : "") + shown(c.highest),
                    analysed(one, label), failed ? shown(fails->first) : "-", failed ? *fails->second : "",
                    program::joined(again, " ")});
  }

  /// The largest level at which the bounds meet the requirement.
  std::string analysed(const simulated::Options& one, const std::string& label) {
    if (!one.deployments.empty()) return "no method";
    bool any = false, for_these = false;
    std::string refused;  // the first level without exact values, or bounds, of several threads
    const std::size_t before = levels_table_.rows.size();
    const Capacity c = tried(label, "analysis", [&](double level, auto&) -> std::optional<std::string> {
      const simulated::Options options = at(one, level);
      Graph graph = setup::graph_to_run(options);
      options.apply_to(graph.platform);
      const GraphTasks tasks = make_tasks(graph);
      const setup::ExecutorSpec spec = setup::executors_to_run(options, graph, tasks).front();
      std::string refusal;
      const auto guaranteed = setup::guarantees(graph, tasks, spec, &options, &refusal);
      if (refused.empty() && !refusal.empty())
        refused = concat("\n", label, ", ", over_, " ", exact(level), ": ", refusal, "\n");
      if (!guaranteed) return refusal.empty() ? "no method covers it" : refusal;
      any = true;
      for_these |= std::ranges::any_of(*guaranteed, [](const auto& of) {
        return of.first.first == Latency::response && of.second.method == bounds::kExactMethod;
      });
      return failure_of(*guaranteed, tasks.set, graph, options_.require);
    });
    notes_ += refused;
    if (any) return shown(c.highest) + (for_these ? " for these phases" : "");
    levels_table_.rows.resize(before);
    return "no method";
  }

  /// Adds a row of each level that a search tries.
  Capacity tried(const std::string& label, const char* source, const Judge& judge) {
    std::map<double, std::vector<program::Value>> measured;
    Capacity capacity =
        find_capacity(levels_, kCoarse, [&](double level) { return judge(level, measured[level]); });
    for (const auto& [index, why] : capacity.tried) {
      const double level = levels_.at(index);
      std::vector<program::Value> row = {
          label, source, {level, kLevelFormat}, !why, index == capacity.highest, why};
      row.insert(row.end(), measured[level].begin(), measured[level].end());
      row.resize(levels_table_.header.size());
      levels_table_.add_row(std::move(row));
    }
    return capacity;
  }

  void write(const std::filesystem::path& folder) const {
    // With 95 % confidence, at least this share of all repetitions would hold.
    const double share = 100 * std::pow(0.05, 1.0 / options_.repetitions);
    const unsigned n = options_.repetitions;
    const std::string below =
        program::text(
            "\n%u of %u repetitions of %g s must hold: with 95 %% confidence at least %.1f %% of all "
            "such runs do.\n",
            n, n, options_.duration_s, share) +
        notes_;
    std::cout << found_ << below;
    program::create_folder(folder);
    program::write_whole_file(folder / "capacity.md", markdown_of(found_, {1, 2, 3}) + below);
    program::write_whole_file(folder / "levels.csv", csv_of(levels_table_));
    nlohmann::json document = columns_and_rows(levels_table_);
    document.update({{"version", HOTPATH_VERSION}, {"over", over_}});
    program::write_whole_file(folder / "capacity.json", document);
    program::show_json(json_of(levels_table_));
    program::draw_figure("capacity", folder);
    std::cout << "\nResults: " << folder.string() << "\n";
  }

  const CapacityOptions options_;
  const std::string over_ = to_string(options_.over);
  const Levels levels_{options_.from, options_.to, options_.resolution};
  /// What is printed, and stored for a page, and the notes below it.
  Table found_{
      concat(options_.graph, ", simulated: largest ", over_, " with ",
             program::joined(options_.require.words), " (steps of ", exact(options_.resolution), ")"),
      {"executor", "largest " + over_, "analysis", "fails at", "why", "holds again at"}};
  std::string notes_;
  Table levels_table_{"", {"executor", "source", over_, "holds", "capacity", "why"}};
};

}  // namespace

void search_capacities(const CapacityOptions& options) { CapacitySearch(options).run(); }

}  // namespace hotpath::sweep
