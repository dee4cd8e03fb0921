// SPDX-License-Identifier: Apache-2.0
#include "live/repeated_attempts.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace hotpath::live {
namespace {

using Key = std::pair<std::size_t, std::uint32_t>;  // executor, number of the attempt

std::map<Key, std::vector<results::SlowPeriod>> slow_attempts(
    const std::vector<results::ExecutorRuns>& runs) {
  std::map<Key, std::vector<results::SlowPeriod>> periods;
  std::vector<results::SpeedJudgement> judgements = results::judge_speed(runs);
  for (std::size_t e = 0; e < judgements.size(); ++e) {
    for (results::SlowRepetition& r : judgements[e].slow) periods[{e, r.repetition}] = std::move(r.periods);
  }
  return periods;
}

/// Null: the attempt was interrupted before it began.
results::RepetitionRecord* entry_of(std::vector<results::RepetitionRecord>& runs, const std::string& executor,
                                    std::uint32_t number) {
  const auto entry = std::ranges::find_if(runs, [&](const results::RepetitionRecord& r) {
    return r.executor == executor && r.repetition == number;
  });
  return entry == runs.end() ? nullptr : &*entry;
}

}  // namespace

SpeedCounts count_slow(const std::vector<results::ExecutorRuns>& runs) {
  SpeedCounts counts;
  for (const results::SpeedJudgement& judgement : results::judge_speed(runs)) {
    counts.observed += judgement.observed;
    counts.slow += judgement.slow.size();
  }
  return counts;
}

void repeat_slow(
    std::vector<results::ExecutorRuns>& runs, std::uint32_t planned, std::uint32_t times,
    const std::function<std::optional<results::Repetition>(const Attempt&)>& measure,
    const std::function<void(const Attempt&, const std::vector<results::SlowPeriod>& slow)>& replaced) {
  std::map<std::uint32_t, std::uint32_t> repetition_of;  // by the number of a later attempt
  std::uint32_t next = planned;
  for (std::uint32_t round = 0; round < times; ++round) {
    for (const auto& [key, unused] : slow_attempts(runs)) {
      const auto [e, counted] = key;
      const auto earlier = repetition_of.find(counted);
      const Attempt attempt{e, earlier == repetition_of.end() ? counted : earlier->second, counted, next++};
      repetition_of[attempt.number] = attempt.repetition;
      std::optional<results::Repetition> measured = measure(attempt);
      if (!measured) continue;
      std::vector<results::Repetition>& repetitions = runs[e].repetitions;
      repetitions.push_back(std::move(*measured));
      auto slow = slow_attempts(runs);
      const bool better = results::lost_time(slow[{e, attempt.number}]) < results::lost_time(slow[key]);
      std::erase_if(repetitions, [&](const results::Repetition& r) {
        return r.trace.repetition == (better ? counted : attempt.number);
      });
      if (better) replaced(attempt, slow[key]);
    }
  }
}

void record_attempt(std::vector<results::RepetitionRecord>& runs, const std::string& executor,
                    const Attempt& attempt) {
  if (attempt.number == attempt.counted) return;
  if (results::RepetitionRecord* const entry = entry_of(runs, executor, attempt.number)) {
    entry->attempt_of = attempt.repetition;
    entry->replaced_by = attempt.counted;
  }
}

void record_replacement(std::vector<results::RepetitionRecord>& runs, const std::string& executor,
                        const Attempt& attempt) {
  entry_of(runs, executor, attempt.number)->replaced_by.reset();
  entry_of(runs, executor, attempt.counted)->replaced_by = attempt.number;
}

}  // namespace hotpath::live
