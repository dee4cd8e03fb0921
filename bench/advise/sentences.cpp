// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>

#include "advise/advice_report.hpp"
#include "advise/ranking.hpp"
#include "program/text.hpp"

namespace hotpath::advise {

namespace {

std::string lost(const Prediction& p) { return program::fixed(loss_percent(p.summary), 1) + " %"; }

std::string compared_with_now(const Advice& advice) {
  const Prediction &best = *advice.best, &now = *advice.now;
  if (!now.overload.empty()) return program::concat(", where ", now.candidate->name, " cannot keep up");
  const double before = score(advice.objective, now.summary).value,
               after = score(advice.objective, best.summary).value;
  std::string text =
      program::concat(" instead of ", value_text(advice.objective, now), " with ", now.candidate->name);
  const bool relative =
      advice.objective.kind == Objective::Kind::latency && before > 0 && std::isfinite(before);
  return relative ? text + program::concat(" (", program::fixed(100 * (1 - after / before), 0), " % less)")
                  : text;
}

std::string first_sentence(const Advice& advice) {
  const std::string objective = advice.objective.text;
  if (advice.best == nullptr) {
    return program::concat("No change can be recommended for ", objective,
                           ": no candidate keeps up, runs every task and loses no more than today.");
  }
  const Prediction& best = *advice.best;
  const std::string value = value_text(advice.objective, best);
  if (&best == advice.now) {
    return program::concat("Keep ", best.candidate->name, ": no other suitable candidate makes ", objective,
                           " smaller than its ", value, " beyond noise.");
  }
  return program::concat("Take ", best.candidate->name, " (", best.candidate->description, "): ", objective,
                         " becomes ", value, compared_with_now(advice), ".");
}

std::string second_sentence(const Advice& advice) {
  const Prediction& best = *advice.best;
  std::string text =
      program::concat("The prediction is based on ", advice.draws, advice.draws == 1 ? " draw" : " draws",
                      " of phases and execution times");
  const auto next = std::ranges::find_if(advice.ranked, [&](const Prediction* p) {
    return p != &best && p->overload.empty() && why_not(*p, *advice.now).empty();
  });
  if (next != advice.ranked.end()) {
    const auto distinct = differs(advice.objective, best, **next);
    text += program::concat("; the best alternative is ", (*next)->candidate->name, " with ",
                            value_text(advice.objective, **next),
                            !distinct   ? ""
                            : *distinct ? ", a difference beyond noise"
                                        : ", a difference within noise");
  }
  text += best.bound_ms ? program::concat("; theory guarantees ", program::fixed(*best.bound_ms, 1), " ms ",
                                          advice.objective.of_hot_path() ? "on the hot path" : "end to end",
                                          " (", best.bound_method, ")")
                        : "; theory gives no bound";
  return text + ".";
}

std::string third_sentence(const Advice& advice) {
  const Prediction &best = *advice.best, &now = *advice.now;
  std::string text = program::concat("It needs ", best.candidate->threads,
                                     best.candidate->threads == 1 ? " thread" : " threads");
  const auto& deployment = best.candidate->spec.deployment;
  if (deployment && std::ranges::any_of(deployment->plan.executors,
                                        [](const DeployedExecutor& e) { return !e.policy.ordinary(); })) {
    text += " with the right to SCHED_FIFO";
  }
  text += program::concat(" and loses ", lost(best), " of all jobs and samples");
  if (&best != &now && now.overload.empty()) text += program::concat(" (today ", lost(now), ")");
  std::string overtaken;
  for (const Doubt& doubt : advice.doubts) {
    if (!doubt.same_first) overtaken += (overtaken.empty() ? "" : " and ") + doubt.assumption;
  }
  if (advice.doubts.empty()) return text + ".";
  return text + (overtaken.empty() ? "; no other candidate overtakes it under the assumptions below."
                                   : "; another candidate overtakes it with " + overtaken + ".");
}

/// Names the timers whose period varies clearly more than today, the worst first.
std::string who_pays(const Advice& advice) {
  constexpr double kShare = 0.05;  // of the period: less does not matter to a periodic callback
  constexpr std::size_t kMost = 3;
  const Prediction &best = *advice.best, &now = *advice.now;
  if (&best == &now || !now.overload.empty()) return "";
  std::vector<std::pair<double, std::string>> paying;  // by the growth as a share of the period
  std::size_t timers = 0;
  for (std::size_t t = 0; t < best.summary.tasks.size(); ++t) {
    const results::TaskSummary &after = best.summary.tasks[t], &before = now.summary.tasks[t];
    timers += after.kind == TaskKind::timer;
    const double growth = (after.period_range_ms() - before.period_range_ms()) / to_ms(after.period);
    if (!(growth > kShare)) continue;  // nor without two jobs
    paying.emplace_back(growth, program::concat(after.task, "'s period varies by ",
                                                program::fixed(after.period_range_ms(), 1), " ms instead of ",
                                                program::fixed(before.period_range_ms(), 1), " ms"));
  }
  if (timers == 0) return "";
  if (paying.empty()) return "No timer pays for it: no period varies clearly more than today.";
  std::ranges::stable_sort(paying, std::greater(), &std::pair<double, std::string>::first);
  const std::size_t more = paying.size() - std::min(kMost, paying.size());
  paying.resize(std::min(kMost, paying.size()));
  std::string text = "Timers pay for it: ";
  for (const auto& [growth, sentence] : paying) text += (text.ends_with(": ") ? "" : "; ") + sentence;
  return text + (more > 0 ? program::concat("; and ", more, " more.") : ".");
}

}  // namespace

const char* bounded_latency(const Objective& objective) {
  return objective.of_hot_path() ? "hot path" : "end to end";
}

std::string value_text(const Objective& objective, const Prediction& p) {
  const Score value = score(objective, p.summary);
  switch (objective.kind) {
    case Objective::Kind::losses:
      return program::fixed(value.value, 2) + " %";
    case Objective::Kind::requirements:
      return value.value > 0
                 ? program::concat("missed by ", program::fixed(value.value, 1), " % in all")
                 : program::concat("met with ", program::fixed(100 * (1 - value.tie), 0), " % to spare");
    case Objective::Kind::latency:
    case Objective::Kind::worst_lateness:
      break;
  }
  return std::isfinite(value.value) ? program::fixed(value.value, 1) + " ms" : "no value";
}

std::vector<std::string> sentences(const Advice& advice) {
  if (advice.best == nullptr) return {first_sentence(advice)};
  std::vector<std::string> all = {first_sentence(advice), second_sentence(advice), third_sentence(advice)};
  if (std::string paying = who_pays(advice); !paying.empty()) all.push_back(std::move(paying));
  return all;
}

}  // namespace hotpath::advise
