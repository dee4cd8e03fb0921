// SPDX-License-Identifier: Apache-2.0
#include "bounds/methods.hpp"

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/spuri_1996.hpp"

namespace hotpath {

ReleaseMode release_mode(const ExecutorEntry& executor) {
  return executor.traits.timers == TimerHandling::release_and_execute ? ReleaseMode::release_and_execute
                                                                      : ReleaseMode::release_only;
}

std::optional<Policy> analysed_policy(const ExecutorEntry& executor) {
  const ExecutorTraits& t = executor.traits;
  const bool stock_re = t.family == Family::events && t.timers == TimerHandling::release_and_execute;
  return stock_re ? std::nullopt : t.policy;
}

bool is_default_executor(const ExecutorEntry& executor) {
  const ExecutorTraits& t = executor.traits;
  return t.family == Family::wait_set && t.runs_first == TaskKind::timer && !t.many_workers;
}

std::vector<NamedAnalysis> analyses(Policy policy) {
  switch (policy) {
    case Policy::rm:
    case Policy::dm:
    case Policy::fp:
      return {{"Brueggen 2015 (Theorem 1)", brueggen_2015},
              {"Davis 2007 (exact)", [](const PeriodicTasks& t) { return davis_2007(t); }}};
    case Policy::edf:
      return {{"Spuri 1996", [](const PeriodicTasks& t) { return spuri_1996(t); }}};
    case Policy::fifo:
      return {{"Bedarkar 2022",
               [](const PeriodicTasks& t) { return ResponseTimes(t.size(), bedarkar_2022(t)); }}};
  }
  return {};
}

}  // namespace hotpath
