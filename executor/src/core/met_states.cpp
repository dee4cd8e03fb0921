// SPDX-License-Identifier: Apache-2.0
#include "met_states.hpp"

#include <algorithm>
#include <numeric>

namespace hotpath {

namespace {

/// The least common multiple of the timers' periods, in ns. Throws ExplorationRefused if it is too long.
std::int64_t hyperperiod(const TaskSet& set) {
  std::int64_t all = 1;
  for (const Task& task : set.tasks) {
    if (task.kind != TaskKind::timer) continue;
    const std::int64_t period = task.period.count(), common = all / std::gcd(all, period);
    if (common > kLongestInstant.count() / period) {
      throw ExplorationRefused("the timers have no common multiple of their periods below 36 years");
    }
    all = common * period;
  }
  return all;
}

/// `coordinates` has kConstant already.
void add_coordinate(const ExploredState& state, const JobInstant& instant,
                    std::vector<std::size_t>& coordinates) {
  const std::size_t coordinate = state.coordinate_of(instant);
  if (std::ranges::find(coordinates, coordinate) == coordinates.end()) coordinates.push_back(coordinate);
}

}  // namespace

void describe_publication(JobRef job, StateWords& words) {
  words.add(words.add_data({job, JobInstant::Kind::publication}, kNever));
}

MetStates::MetStates(const TaskSet& set, bool publications)
    : hyperperiod_(hyperperiod(set)), publications_(publications) {}

std::optional<MetStates::Next> MetStates::next() {
  while (!pending_.empty()) {
    const std::size_t place = pending_.top().second;
    pending_.pop();
    Met& met = met_[place];
    if (met.state) return Next{std::move(met.state), {place, met.coordinates, met.origin}};
  }
  return std::nullopt;
}

std::vector<std::int64_t> MetStates::describe(const ExploredState& state, std::int64_t origin,
                                              std::vector<std::size_t>& coordinates) const {
  StateWords words(from_ns(origin));
  state.simulation->describe(words, state.wakes, state.releases);
  for (const UncertainInstant& instant : state.uncertain()) {
    if (instant.coordinate >= kInstants && !state.simulation->several())
      words.add_data(state.instants[instant.coordinate - kInstants], kNever);
  }
  state.simulation->scheduler().describe(words);
  state.simulation->workload().describe(words);
  const auto add_job = [&](const SimulatedWorkers::State& thread) {
    const Job& job = thread.record.job;
    if (publications_ && !job.empty && !is_of_timer(job)) describe_publication(job.parent, words);
    if (thread.step == ExploredState::Step::run) add_coordinate(state, {job.ref()}, coordinates);
  };
  if (state.simulation->several()) {
    for (const Worker w : state.simulation->workers().on_cores()) {
      coordinates.push_back(state.end_of_job(w));
      add_job(state.simulation->workers()[w]);
    }
  } else {
    if (state.busy() || state.wakes) coordinates.push_back(kEnd);
    if (state.releases) coordinates.push_back(kTimers);
    if (state.simulation->shares_core() && state.executor().on_core) coordinates.push_back(kSlice);
    if (state.busy() && state.executor().has_job) add_job(state.executor());
  }
  for (const JobInstant& instant : words.data()) add_coordinate(state, instant, coordinates);
  return words.take_words();
}

void MetStates::enter(ExploredState state,
                      const std::function<void(const ExploredState&, ExploredPaths::End)>& way) {
  constexpr Time kBeforeAll{Duration(-1)};
  const Time first_call = state.simulation->scheduler().next_change(kBeforeAll);
  const std::int64_t origin = first_call == kNever ? 0 : to_ns(first_call) / hyperperiod_ * hyperperiod_;
  std::vector<std::size_t> coordinates = {kConstant};
  std::vector<std::size_t>& same = known_[describe(state, origin, coordinates)];
  Zone zone = state.zone.select(coordinates);
  zone.shift(-origin);
  for (const std::size_t place : same) {
    if (met_[place].zone.contains(zone)) return;
  }
  for (const std::size_t place : same) {
    Met& met = met_[place];
    if (!met.state) continue;
    std::optional<Zone> joined = Zone::joined(met.zone, zone);
    if (!joined) continue;
    way(state, {place, coordinates, origin});
    met.zone = std::move(*joined);
    met.state->from = std::min(met.state->from, state.from + Duration(met.origin - origin));
    take_over_zone(met);
    pending_.emplace(earliest(met), place);
    return;
  }
  way(state, {met_.size(), coordinates, origin});
  same.push_back(met_.size());
  met_.push_back(
      {std::move(zone), std::move(coordinates), origin, std::make_unique<ExploredState>(std::move(state))});
  forget_other_instants(met_.back());
  pending_.emplace(earliest(met_.back()), met_.size() - 1);
}

void MetStates::forget_other_instants(Met& met) {
  ExploredState& state = *met.state;
  std::vector<JobInstant> kept;
  for (std::size_t& coordinate : met.coordinates) {
    if (coordinate < kInstants) continue;
    kept.push_back(state.instants[coordinate - kInstants]);
    coordinate = kInstants + kept.size() - 1;
  }
  state.instants = std::move(kept);
  take_over_zone(met);
}

void MetStates::take_over_zone(Met& met) {
  std::vector<std::size_t> numbers(kInstants + met.state->instants.size(), 0);
  for (std::size_t i = 0; i < met.coordinates.size(); ++i) numbers[met.coordinates[i]] = i;
  Zone absolute = met.zone;
  absolute.shift(met.origin);
  met.state->zone = absolute.select(numbers);
}

std::int64_t MetStates::earliest(const Met& met) {
  const ExploredState& state = *met.state;
  const std::vector<UncertainInstant> instants = state.uncertain();
  if (instants.empty()) return to_ns(state.next_of_others());
  const auto lowest = [&](const UncertainInstant& instant) { return state.zone.lowest(instant.coordinate); };
  return lowest(std::ranges::min(instants, {}, lowest));
}

}  // namespace hotpath
