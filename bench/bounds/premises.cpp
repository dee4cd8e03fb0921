// SPDX-License-Identifier: Apache-2.0
#include "bounds/premises.hpp"

#include <algorithm>

#include "program/text.hpp"

namespace hotpath::bounds {

namespace {

std::string kinds_of(const TaskSet& set) {
  std::string text = "timers";
  for (const auto& [kind, word] : enum_texts(EntityKind{})) {
    const auto is_one = [kind = kind](const Task& task) {
      return task.kind == TaskKind::subscription && task.entity == kind;
    };
    if (std::ranges::any_of(set.tasks, is_one)) text += program::concat(", ", word, "s");
  }
  return text + (text == "timers" ? " only" : "");
}

}  // namespace

std::vector<Premise> premises(const Graph& graph, const TaskSet& set, const std::string& executor,
                              bool phases_known) {
  const GraphPlatform& platform = graph.platform;
  std::vector<Premise> all = {{executor},
                              {"callbacks: " + kinds_of(set)},
                              {"no job takes longer than the graph says"},
                              {phases_known ? "the given phases" : "any phases"}};
  const Duration delivery = platform.delivery_delay;
  all.push_back(delivery > Duration{} ? Premise{program::concat("delivery takes ", to_us(delivery), " us")}
                                      : Premise{"delivery takes no time", false});
  std::string costs;
  for (const PlatformCost& cost : kPlatformCosts) {
    const Duration value = cost.in(platform).value_or(Duration{});
    if (value == Duration{} || cost.value == &Platform::delivery_delay) continue;
    costs += program::concat(costs.empty() ? "" : ", ", cost.key, " ", to_us(value));
  }
  all.push_back(costs.empty() ? Premise{"the executor's own work takes no time", false} : Premise{costs});
  const bool jitter =
      std::ranges::any_of(set.tasks, [](const Task& task) { return task.release_jitter > Duration{}; });
  all.push_back(jitter ? Premise{"release jitter as in the graph"} : Premise{"timers have no jitter", false});
  all.push_back({"its threads have the processor to themselves", false});
  return all;
}

std::string list_of(const std::vector<Premise>& premises, bool stated) {
  std::string text;
  for (const Premise& premise : premises) {
    if (premise.stated == stated) text += (text.empty() ? "" : "; ") + premise.text;
  }
  return text;
}

}  // namespace hotpath::bounds
