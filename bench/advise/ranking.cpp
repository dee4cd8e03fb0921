// SPDX-License-Identifier: Apache-2.0
#include "advise/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "advise/advice_report.hpp"

namespace hotpath::advise {

namespace {

constexpr double kMoreLosses_percent = 1;

double probability(const Objective& objective) {
  return objective.kind != Objective::Kind::latency            ? 1.0
         : objective.statistic == Objective::Statistic::median ? 0.5
         : objective.statistic == Objective::Statistic::p99    ? 0.99
                                                               : 1.0;
}

}  // namespace

std::size_t never_ran(const results::ExecutorSummary& summary) {
  return static_cast<std::size_t>(std::ranges::count_if(summary.tasks, &results::TaskSummary::never_ran));
}

std::optional<bool> differs(const Objective& objective, const Prediction& a, const Prediction& b) {
  if (objective.kind != Objective::Kind::latency) return std::nullopt;
  const Estimate difference =
      difference_of_quantiles(latencies_of(a, objective), latencies_of(b, objective), probability(objective));
  if (!difference.interval) return std::nullopt;
  return difference.interval->low > 0 || difference.interval->high < 0;
}

std::vector<const Prediction*> ranked(const std::vector<Prediction>& predictions,
                                      const Objective& objective) {
  std::vector<const Prediction*> order;
  order.reserve(predictions.size());
  for (const Prediction& p : predictions) order.push_back(&p);
  std::ranges::stable_sort(order, [&](const Prediction* a, const Prediction* b) {
    if (a->overload.empty() != b->overload.empty()) return a->overload.empty();
    return a->overload.empty() && score(objective, a->summary) < score(objective, b->summary);
  });
  return order;
}

bool can_be_written(const Candidate& candidate) {
  if (!candidate.spec.deployment) return true;
  try {
    (void)deployment_yaml(candidate.graph, candidate.tasks, candidate.spec.deployment->plan);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

std::string why_not(const Prediction& p, const Prediction& now) {
  if (never_ran(p.summary) > 0) return "a task never runs";
  const double most = now.overload.empty() ? loss_percent(now.summary) + kMoreLosses_percent : INFINITY;
  if (loss_percent(p.summary) > most) return "it loses more than today";
  return can_be_written(*p.candidate) ? "" : "it splits callback groups";
}

const Prediction* recommended(const std::vector<const Prediction*>& ranked, const Prediction& now,
                              const Objective& objective) {
  const auto suits = [&](const Prediction* p) { return p->overload.empty() && why_not(*p, now).empty(); };
  const auto best = std::ranges::find_if(ranked, suits);
  if (best == ranked.end()) return nullptr;
  const bool same = differs(objective, **best, now) == false ||
                    (now.overload.empty() && value_text(objective, **best) == value_text(objective, now));
  return suits(&now) && same ? &now : *best;
}

}  // namespace hotpath::advise
