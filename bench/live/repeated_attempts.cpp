// SPDX-License-Identifier: Apache-2.0
#include "live/repeated_attempts.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace hotpath {
namespace {

using Key = std::pair<std::size_t, std::uint32_t>;  // executor, number of the attempt

std::map<Key, std::vector<SlowPeriod>> slow_attempts(const std::vector<ExecutorRuns>& runs) {
  std::map<Key, std::vector<SlowPeriod>> found;
  std::vector<SpeedJudgement> judged = judge_speed(runs);
  for (std::size_t e = 0; e < judged.size(); ++e) {
    for (SlowRepetition& r : judged[e].slow) found[{e, r.repetition}] = std::move(r.periods);
  }
  return found;
}

}  // namespace

void repeat_disturbed(
    std::vector<ExecutorRuns>& runs, std::uint32_t planned, std::uint32_t times,
    const std::function<std::optional<Repetition>(const Attempt&)>& measure,
    const std::function<void(const Attempt&, const std::vector<SlowPeriod>& wrong)>& replaced) {
  std::map<std::uint32_t, std::uint32_t> repetition_of;  // by the number of a later attempt
  std::uint32_t next = planned;
  for (std::uint32_t round = 0; round < times; ++round) {
    for (const auto& [key, unused] : slow_attempts(runs)) {
      const auto [e, counted] = key;
      const auto known = repetition_of.find(counted);
      const Attempt attempt{e, known == repetition_of.end() ? counted : known->second, counted, next++};
      repetition_of[attempt.number] = attempt.repetition;
      std::optional<Repetition> measured = measure(attempt);
      if (!measured) continue;
      std::vector<Repetition>& repetitions = runs[e].repetitions;
      repetitions.push_back(std::move(*measured));
      auto judged = slow_attempts(runs);
      const bool better = lost_time(judged[{e, attempt.number}]) < lost_time(judged[key]);
      std::erase_if(repetitions, [&](const Repetition& r) {
        return r.trace.repetition == (better ? counted : attempt.number);
      });
      if (better) replaced(attempt, judged[key]);
    }
  }
}

}  // namespace hotpath
