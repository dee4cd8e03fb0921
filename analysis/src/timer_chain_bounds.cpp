// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davare_2007.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/duerr_2019.hpp"
#include "hotpath/analysis/guenzel_2023.hpp"
#include "hotpath/analysis/kloda_2018.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "hotpath/analysis/teper_2024.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using A = Assumption;

constexpr std::uint32_t kCosts = bits({A::costs});
constexpr std::uint32_t kAnyPhases = bits({A::unknown_phases, A::shifted_phases});

/// A response time analysis that the chain methods accept.
struct Response {
  const char* name;
  std::uint32_t covers;
  Priorities priorities;
  ResponseTimes (*analysis)(const PeriodicTasks&);
};
const std::array kResponses = {
    Response{"Brueggen 2015 (Theorem 1)", bits({A::fixed_priorities, A::runs_timers}), Priorities::fixed,
             brueggen_2015},
    Response{"Davis 2007 (exact)", bits({A::fixed_priorities, A::runs_timers}), Priorities::fixed,
             [](const PeriodicTasks& t) { return davis_2007(t); }},
    Response{"Spuri 1996", bits({A::deadlines, A::runs_timers}), Priorities::dynamic,
             [](const PeriodicTasks& t) { return spuri_1996(t); }},
    Response{"Bedarkar 2022", bits({A::activation_order, A::late_releases}), Priorities::dynamic,
             [](const PeriodicTasks& t) { return ResponseTimes(t.size(), bedarkar_2022(t)); }},
};

struct EndToEnd {
  const char* name;
  std::uint32_t covers;
  std::int64_t (*latency)(const PeriodicTasks&, const ResponseTimes&, const TaskChain&, Priorities);
};
const std::array kEndToEnd = {
    EndToEnd{"Davare 2007", kAnyPhases,
             [](const PeriodicTasks& t, const ResponseTimes& r, const TaskChain& c, Priorities) {
               return davare_2007(t, r, c);
             }},
    EndToEnd{"Duerr 2019", kAnyPhases,
             [](const PeriodicTasks& t, const ResponseTimes& r, const TaskChain& c, Priorities p) {
               return duerr_2019_reaction_time(t, r, c, p);
             }},
    EndToEnd{"Kloda 2018", 0,
             [](const PeriodicTasks& t, const ResponseTimes& r, const TaskChain& c, Priorities p) {
               return kloda_2018(t, r, c, p);
             }},
    EndToEnd{"Guenzel 2023", bits({A::shifted_phases}),
             [](const PeriodicTasks& t, const ResponseTimes& r, const TaskChain& c, Priorities p) {
               return guenzel_2023(t, r, c, p);
             }},
};

/// The result of `find`, unless an assumption is missing.
template <typename Find>
TimerChainBound attempt(std::string method, std::uint32_t missing, Find&& find) {
  TimerChainBound bound{std::move(method), std::nullopt, {}};
  if (missing != 0) {
    bound.refusal = not_covered(missing);
    return bound;
  }
  try {
    bound.latency = find();
  } catch (const AnalysisError& error) {
    bound.refusal = error.what();
  }
  return bound;
}

}  // namespace

std::vector<TimerChainBound> timer_chain_bounds(const BoundedSystem& system,
                                                const std::vector<std::string>& names,
                                                std::uint32_t also_covers) {
  const std::uint32_t present = assumptions_of(system);
  std::vector<TimerChainBound> bounds, refused;
  for (const Response& r : kResponses) {
    const std::uint32_t uncovered = present & ~(r.covers | kCosts | kAnyPhases | also_covers);
    if (uncovered != 0) {
      refused.push_back({r.name, std::nullopt, not_covered(uncovered)});
      continue;
    }
    OverheadAwareResponse response;
    try {
      response = timer_responses(system, r.analysis);
    } catch (const AnalysisError& error) {
      bounds.push_back({r.name, std::nullopt, error.what()});
      continue;
    }
    const TaskChain chain = task_chain(response.tasks, names);
    for (const EndToEnd& e : kEndToEnd) {
      const std::uint32_t missing = present & kAnyPhases & ~(e.covers | also_covers);
      bounds.push_back(attempt(std::string(e.name) + ", " + r.name, missing, [&] {
        return e.latency(response.tasks, response.bounds, chain, r.priorities);
      }));
    }
  }
  const std::uint32_t by_windows = bits({A::polling, A::subscriptions}) | kAnyPhases | also_covers;
  if ((present & bits({A::polling})) != 0) {
    bounds.push_back(attempt("Teper 2024", present & ~by_windows, [&] {
      const TaskSet& set = system.graph.set;
      PeriodicTasks in_order;
      for (const TaskId id : poll_order(set)) in_order.push_back({.name = set[id].name, .id = id});
      std::vector<TaskId> chain;
      for (const std::size_t position : task_chain(in_order, names)) {
        chain.push_back(in_order[position].id);
      }
      return teper_2024(set, chain);
    }));
  }
  return bounds.empty() ? refused : bounds;
}

}  // namespace hotpath
