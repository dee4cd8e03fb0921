// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "hotpath/analysis/graph_bounds.hpp"
#include "program/text.hpp"
#include "program/text_table.hpp"
#include "results/measures.hpp"
#include "results/stored_run.hpp"

namespace hotpath::bounds {

/// Nanoseconds as milliseconds; `-` for none.
inline std::string in_ms(std::optional<std::int64_t> ns) {
  return ns ? program::fixed(to_ms(Duration(*ns)), 3) : "-";
}

/// Response times, end-to-end and hot-path latencies of a run, by kind (`task`, `chain` or
/// `hot_path`), executor and name.
class Observed {
 public:
  /// Throws UsageError, which names `--trace`, unless the folder holds a run of these tasks.
  Observed(results::StoredRun& run, const TaskSet& set) {
    run.load(set);
    for (const Trace& trace : run.traces()) {
      for (const JobRecord& r : trace.jobs) {
        if (r.outcome == Outcome::ran)
          keep({"task", trace.executor, set[r.job.task].name}, results::response_time(r));
      }
      for (const ChainRecord& c : trace.chains) {
        keep({"hot_path", trace.executor, run.chains()[c.chain]}, c.hot_path_latency);
        if (c.end_to_end_latency < Duration::zero()) continue;  // unknown
        keep({"chain", trace.executor, run.chains()[c.chain]}, c.end_to_end_latency);
      }
    }
  }

  /// In no order.
  const std::vector<std::int64_t>& of(const std::array<std::string, 3>& key) const {
    static const std::vector<std::int64_t> none;
    const auto entry = values_.find(key);
    return entry == values_.end() ? none : entry->second;
  }

 private:
  void keep(const std::array<std::string, 3>& key, Duration value) { values_[key].push_back(value.count()); }

  std::map<std::array<std::string, 3>, std::vector<std::int64_t>> values_;
};

/// The bounds of a graph's tasks and chains, beside the observations of a run, if there is one.
class Report {
 public:
  /// Tasks must outlive it.
  Report(const TaskSet& set, const std::optional<Observed>& observed, std::ostream& out)
      : set_(set), observed_(observed), out_(out) {}

  /// Prints to standard output.
  void print(const std::string& executor, const CallbackGraph& graph, const GraphBounds& bounds) {
    out_ << "\n" << executor << ", " << bounds.method << "\n";
    program::TextTable tasks = table("task", {"deadline"});
    for (TaskId id = 0; id < set_.size(); ++id) {
      const bool timer = set_[id].kind == TaskKind::timer;
      Row row{{"task", executor, set_[id].name}, bounds.method, bounds.tasks[id]};
      if (timer) row.deadline = set_[id].deadline.count();
      if (bounds.parts.contains(id)) row.dominated_by = consists_of(bounds.parts.at(id));
      add_row(tasks, row, {timer ? in_ms(row.deadline) : ""});
    }
    out_ << tasks;
    print_verdict(bounds);
    if (bounds.chains.empty()) return;
    program::TextTable chains = table("chain, end to end", {"response", "waiting", "last timer"});
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      const std::optional<ChainAge>& age = bounds.chains[c];
      std::vector<std::string> parts = {"-", "-", bounds.no_chain_bound[c]};
      Row row{{"chain", executor, graph.chains[c].name}, bounds.method};
      if (age && age->last_timer == kNoTask) {
        parts = {"-", "-", "-"};
        row.bound = age->latency;
      } else if (age) {
        parts = {in_ms(age->response), in_ms(age->waiting), set_[age->last_timer].name};
        row.bound = age->latency;
        row.response = age->response;
        row.waiting = age->waiting;
        row.dominated_by = dominated_by(*age);
      }
      add_row(chains, row, parts);
    }
    out_ << chains;
    print_hot_paths(executor, graph, bounds);
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      if (bounds.chains[c] && bounds.chains[c]->last_timer != kNoTask)
        out_ << graph.chains[c].name << ": " << dominated_by(*bounds.chains[c]) << "\n";
    }
  }

  void print_hot_paths(const std::string& executor, const CallbackGraph& graph, const GraphBounds& bounds) {
    const auto bounded = [](const std::optional<ChainAge>& age) { return age && age->hot_path; };
    if (std::ranges::none_of(bounds.chains, bounded)) return;
    program::TextTable chains = table("chain, hot path", {});
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      Row row{{"hot_path", executor, graph.chains[c].name}, bounds.method};
      if (bounds.chains[c]) row.bound = bounds.chains[c]->hot_path;
      add_row(chains, row, {});
    }
    out_ << chains;
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
  program::TextTable table(const std::string& subject, std::vector<std::string> more) const {
    std::vector<std::string> header = {subject, "bound ms"};
    header.insert(header.end(), more.begin(), more.end());
    if (observed_) header.insert(header.end(), {"observed ms", "tightness", ""});
    return {"", header};
  }

  /// The largest parts of a bound, which to reduce for a smaller one.
  std::string dominated_by(const ChainAge& age) const {
    std::string out;
    if (age.waited_at != kNoTask) out = part(age.waiting, "ms waiting at " + set_[age.waited_at].name + "; ");
    out += part(age.response, "ms behind " + set_[age.last_timer].name + "'s timestamp");
    return age.parts.work.empty() ? out : out + ": " + consists_of(age.parts);
  }

  std::string consists_of(const PathParts& parts) const {
    constexpr std::size_t kMost = 5;
    std::string out;
    if (parts.blocking > 0) {
      const bool job = parts.blocker != kNoTask;
      out += part(parts.blocking, job ? "blocked by " + set_[parts.blocker].name + "; " : "waking up; ");
    }
    for (std::size_t i = 0; i < std::min(kMost, parts.work.size()); ++i) {
      out += (i > 0 ? "; " : "") + part(parts.work[i].second, set_[parts.work[i].first].name);
    }
    return out + (parts.work.size() > kMost ? "; ..." : "");
  }

  static std::string part(std::int64_t ns, const std::string& cause) { return in_ms(ns) + " " + cause; }

  struct Row {
    std::array<std::string, 3> key;  ///< Kind, executor, name.
    std::string method;
    std::optional<std::int64_t> bound{}, deadline{}, response{}, waiting{};
    std::string dominated_by{};
  };

  void add_row(program::TextTable& rows, const Row& row, const std::vector<std::string>& more) {
    const auto& [key, method, bound, deadline, response, waiting, dominated] = row;
    std::vector<program::TextTable::Cell> cells = {key[2], in_ms(bound)};
    cells.insert(cells.end(), more.begin(), more.end());
    std::optional<std::int64_t> observed;
    std::optional<double> tightness;  // observed / bound
    bool violated = false;
    if (observed_) {
      const std::vector<std::int64_t>& values = observed_->of(key);
      if (!values.empty()) observed = std::ranges::max(values);
      if (bound && observed) {
        violated = *observed > *bound;
        if (*bound > 0) tightness = static_cast<double>(*observed) / static_cast<double>(*bound);
      }
      count(values, key, method, bound);
      cells.insert(cells.end(), {in_ms(observed), tightness ? program::fixed(*tightness, 3) : "-",
                                 violated ? "VIOLATED" : ""});
    }
    rows.add_row(cells);
    program::write_row(csv_, key[1], method, key[0], key[2], bound, observed, tightness,
                       violated ? "yes" : "no", deadline, response, waiting, dominated);
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
      out_ << "Schedulability not shown: " << set_[id].name << " may exceed its deadline.\n";
      return;
    }
    out_ << "Schedulable: every timer meets its deadline.\n";
  }

  const TaskSet& set_;
  const std::optional<Observed>& observed_;
  std::ostream& out_;
  std::ostringstream csv_;
  std::size_t violations_ = 0, compared_ = 0;
  std::string first_violation_;
};

}  // namespace hotpath::bounds
