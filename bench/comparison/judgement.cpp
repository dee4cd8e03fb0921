// SPDX-License-Identifier: Apache-2.0
#include "comparison/judgement.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::comparison {

namespace {

constexpr double kLeastEffect = 0.02;  // smaller growth of a latency raises no alarm, unless it is exact
constexpr std::size_t kLeastRepetitions = 3;

/// What two sides have of one measure.
struct Compared {
  Key key;
  Measure measure;
  Series before, after;
};

double least(const Series& series) {
  return std::ranges::min_element(series, {}, &Series::value_type::second)->second;
}

bool any(const Series& series) {
  return std::ranges::any_of(series, [](const auto& of) { return of.second != 0; });
}

/// How many repetitions both sides have.
std::size_t common(const Series& a, const Series& b) {
  return static_cast<std::size_t>(
      std::ranges::count_if(a, [&](const auto& r) { return b.contains(r.first); }));
}

/// Whether less than half of the outputs is left in a repetition, or in one of those that are not pairs
/// compared with the least before. A single one can end after the run.
bool dries_up(const Series& before, const Series& after, Pairing pairing) {
  const auto dried = [](double old, double now) {
    return old > 0 && (now == 0 || now < std::min(old / 2, old - 1));
  };
  if (pairing == Pairing::independent) return dried(least(before), least(after));
  return std::ranges::any_of(before, [&](const auto& r) { return dried(r.second, after.at(r.first)); });
}

/// Statistics of each repetition, all above 0.
std::map<Measure, Series> measures_of(const Samples& samples) {
  std::map<Measure, Series> measures;
  for (const Samples::Repetition& r : samples.repetitions) {
    const Quantiles q = quantiles(r.ms);
    for (const auto& [measure, ms] :
         {std::pair(Measure::mean, q.mean), {Measure::p50, q.p50}, {Measure::p99, q.p99}})
      measures[measure][r.number] = std::max(ms, kNothing_ms);
  }
  return measures;
}

/// A test of counts of which fewer are worse finds the growth of their negatives.
void negate(GrowthTest& test) {
  for (double* const value : {&test.before, &test.after, &test.growth}) *value = -*value + 0.0;  // no -0
  test.interval = {-test.interval.high, -test.interval.low};
}

class Judge {
  using Planned = std::pair<Series, Series>;

 public:
  Judge(const Side& before, const Side& after, bool interleaved)
      : before_(before), after_(after), interleaved_(interleaved) {
    const auto plan = [this](const Side& side, Series Planned::*numbers) {
      for (const auto& [of, series] : side.counts) {
        Planned& planned = planned_[{of.second.source, of.second.setting, of.second.executor}];
        for (const auto& [number, _] : series) {
          if (of.first != Measure::losses) (planned.*numbers)[number] = 0;
        }
      }
    };
    plan(before, &Planned::first);
    plan(after, &Planned::second);
  }

  /// Everything to compare.
  [[nodiscard]] std::vector<Compared> series() const {
    std::vector<Compared> all;
    for (const auto& [key, samples] : before_.samples) {
      const auto now = after_.samples.find(key);
      if (now == after_.samples.end()) continue;
      auto grown = measures_of(now->second);
      for (auto& [measure, of] : measures_of(samples)) all.push_back({key, measure, of, grown[measure]});
    }
    std::map<std::pair<Measure, Key>, Series> counted = before_.counts;
    counted.insert(after_.counts.begin(), after_.counts.end());
    for (const auto& [of, _] : counted) {
      const auto& [measure, key] = of;
      const bool losses = measure == Measure::losses;
      if (losses && !(before_.counts.contains(of) && after_.counts.contains(of))) continue;
      const auto series_of = [&](const Side& side, const Series& none) {
        const auto found = side.counts.find(of);
        return found == side.counts.end() ? none : found->second;
      };
      const auto& [old, now] = planned_.at({key.source, key.setting, key.executor});
      Compared c{key, measure, series_of(before_, old), series_of(after_, now)};
      // Otherwise an executor did not run.
      const bool ran = !c.before.empty() && !c.after.empty() && (any(c.before) || any(c.after));
      if (losses || ran) all.push_back(std::move(c));
    }
    return all;
  }

  /// One comparison of `tests`, of the common repetitions if these are pairs.
  [[nodiscard]] Judgement compare(Compared c, std::size_t tests) const {
    Judgement made;
    made.what = text_of(c.key);
    made.measure = c.measure;
    made.pairing = pairing_of(c);
    made.simulated = c.key.source == Source::simulated;
    if (made.pairing != Pairing::independent) {
      std::erase_if(c.before, [&](const auto& r) { return !c.after.contains(r.first); });
      std::erase_if(c.after, [&](const auto& r) { return !c.before.contains(r.first); });
    }
    const bool fewer_is_worse = c.measure == Measure::outputs || c.measure == Measure::jobs;
    const auto values = [&](const Series& series) {
      std::vector<double> signed_values;
      for (const auto& [_, value] : series) signed_values.push_back(fewer_is_worse ? -value : value);
      return signed_values;
    };
    const Scale scale = made.counted() ? Scale::difference : Scale::ratio;
    made.test = test_growth(values(c.before), values(c.after), made.pairing, scale);
    made.detectable = detectable_growth(made.test, scale, kAlarmRate / static_cast<double>(tests), kPower);
    if (fewer_is_worse) {
      negate(made.test);
      made.dried_up = dries_up(c.before, c.after, made.pairing);
      made.sprang_up = dries_up(c.after, c.before, made.pairing);
    }
    return made;
  }

  /// Executors with a repetition that the other side does not have.
  void add_repetitions(std::vector<Judgement>& made) const {
    for (const auto& [executor, planned] : planned_) {
      const auto& [old, now] = planned;
      const auto& [source, setting, name] = executor;
      const bool simulated = source == Source::simulated;
      const std::size_t fewest = std::min(old.size(), now.size()), both = common(old, now);
      const bool paired = (simulated || interleaved_) && both == fewest;
      if (old == now || !(paired || fewest == 0)) continue;
      Judgement& j = made.emplace_back();
      j.what = program::concat(to_string(source), " ", setting, " ", name);
      j.measure = Measure::repetitions;
      j.test.before = static_cast<double>(old.size());
      j.test.after = static_cast<double>(now.size());
      j.test.growth = j.test.after - j.test.before;
      j.test.exact = true;
      j.pairing = simulated ? Pairing::exact : Pairing::paired;
      j.simulated = simulated;
      j.dried_up = both < old.size();
    }
  }

 private:
  [[nodiscard]] Pairing pairing_of(const Compared& c) const {
    const bool simulated = c.key.source == Source::simulated;
    const std::size_t fewest = std::min(c.before.size(), c.after.size());
    if (common(c.before, c.after) == fewest) {
      if (simulated && (interleaved_ || draws_agree(before_, after_, c.key.executor))) return Pairing::exact;
      if (interleaved_ && fewest >= kLeastRepetitions) return Pairing::paired;
    }
    if (fewest >= kLeastRepetitions) return Pairing::independent;
    throw program::UsageError(
        program::concat(text_of(c.key), ": the gate needs ", kLeastRepetitions, " repetitions",
                        simulated ? " of other seeds" : "", " on each side, one side has ", fewest, "; ",
                        simulated ? "give both the same --seed, phases and --duration, or" : "measure with",
                        " --repetitions 20"));
  }

  const Side &before_, &after_;
  const bool interleaved_;
  /// 0 for each planned repetition of both sides, by source, setting and executor.
  std::map<std::tuple<Source, std::string, std::string>, Planned> planned_;
};

}  // namespace

double Judgement::detectable_percent() const {
  return exact() ? 0 : 100 * std::max(detectable - 1, kLeastEffect);
}

bool Judgement::worse() const {
  if (dried_up || shrank || adjusted >= kAlarmRate) return dried_up;
  if (measure == Measure::outputs)  // one can end after the run
    return test.growth < -std::max(1.0, kLeastEffect * test.before);
  return exact() || percent() > 100 * kLeastEffect || measure == Measure::losses;
}

Verdict Judgement::verdict() const {
  if (worse()) return Verdict::worse;
  if (measure == Measure::repetitions) return Verdict::not_comparable;  // the old side has none
  return shrank ? Verdict::better : Verdict::same;
}

/// Without what is better.
static std::vector<Judgement> judge_growth(const Side& before, const Side& after, bool interleaved) {
  const Judge both(before, after, interleaved);
  const std::vector<Compared> series = both.series();
  const auto jobs = std::ranges::count(series, Measure::jobs, &Compared::measure);
  const std::size_t tests = std::max<std::size_t>(1, series.size() - static_cast<std::size_t>(jobs));
  std::vector<Judgement> made, of_jobs;
  for (const Compared& c : series)
    (c.measure == Measure::jobs ? of_jobs : made).push_back(both.compare(c, tests));
  std::vector<double> p_values;
  for (const Judgement& j : made) p_values.push_back(j.test.p_value);
  const std::vector<double> adjusted = holm(p_values);
  for (std::size_t i = 0; i < made.size(); ++i) made[i].adjusted = adjusted[i];
  std::ranges::copy_if(of_jobs, std::back_inserter(made),
                       [](const Judgement& j) { return j.dried_up || j.sprang_up; });
  both.add_repetitions(made);
  return made;
}

std::vector<Judgement> judge(const Side& before, const Side& after, bool interleaved) {
  std::vector<Judgement> made = judge_growth(before, after, interleaved);
  const std::vector<Judgement> swapped = judge_growth(after, before, interleaved);
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (made[i].worse() || !swapped[i].worse()) continue;
    made[i].shrank = true;
    made[i].adjusted = swapped[i].adjusted;
  }
  return made;
}

}  // namespace hotpath::comparison
