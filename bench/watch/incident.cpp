// SPDX-License-Identifier: Apache-2.0
#include "watch/incident.hpp"

#include <algorithm>
#include <ctime>

#include "program/text.hpp"

namespace hotpath::watch {

WallClock WallClock::now() {
  using namespace std::chrono;
  return WallClock(system_clock::now().time_since_epoch() - steady_clock::now().time_since_epoch());
}

void WallClock::follow(const WallClock& clock, Time from) {
  const Duration offset = clock.offsets_.back().second;
  if (std::chrono::abs(offset - offsets_.back().second) < kStep) return;
  offsets_.emplace_back(from, offset);
  if (offsets_.size() > kMost) offsets_.pop_front();
}

std::string WallClock::text(Time at) const {
  const auto after = std::ranges::upper_bound(offsets_, at, {}, [](const auto& o) { return o.first; });
  const Duration offset = (after == offsets_.begin() ? after : std::prev(after))->second;
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at.time_since_epoch() + offset);
  const auto s = std::chrono::floor<std::chrono::seconds>(ms);
  const std::time_t seconds = s.count();
  std::tm local{};
  localtime_r(&seconds, &local);
  return program::text("%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                       static_cast<int>((ms - s).count()));
}

void Incident::add(Role role, const Breach& breach) {
  ++breaches_;
  last_ = std::max(last_, breach.at);
  std::optional<Breach>& first = first_[static_cast<std::size_t>(role)];
  if (first && first->at <= breach.at) return;
  first = breach;
  ++changes_;
}

void Incident::correct(Role role, const Breach& breach) {
  if (breach.at < begin().at || breach.at > last_) return;  // of another incident
  last_ = std::max(last_, breach.until);
  std::optional<Breach>& first = first_[static_cast<std::size_t>(role)];
  if (!first || !first->continues(breach)) return;
  first = breach;
  ++changes_;
}

const Breach& Incident::begin() const {
  const auto at = [](const auto& first) { return first ? first->at : Time::max(); };
  return **std::ranges::min_element(first_, {}, at);
}

/// The first exceeded bound, or else the first missed requirement.
const std::optional<Breach>& Incident::effect() const {
  return first(Role::bound) ? first(Role::bound) : first(Role::requirement);
}

std::string Incident::text(const WallClock& clock, const std::string& unseen) const {
  const std::optional<Breach>& cause = first(Role::assumption);
  const auto stated = [&](const Breach& breach) { return clock.text(breach.at) + " " + breach.sentence; };
  if (!effect()) return cause ? stated(*cause) : "";
  if (cause && cause->at <= effect()->at) {
    return stated(*cause) + "; " + program::fixed(to_ms(effect()->at - cause->at), 3) + " ms later " +
           effect()->sentence;
  }
  if (!first(Role::bound)) return stated(*effect()) + ", while no bound was exceeded";
  if (!unseen.empty())
    return stated(*effect()) + ", while no assumption was seen to be broken; not observable: " + unseen;
  return stated(*effect()) +
         ", while every assumption that the contract states held: a defect of hotpath, or the contract "
         "lacks an assumption; please report it with a snapshot (--record)";
}

void Incidents::add(Role role, const Breach& breach) {
  if (kept_.empty() || breach.at > kept_.back().last() + kPause) {
    kept_.emplace_back(count() + 1);
    if (kept_.size() > kMost) kept_.erase(kept_.begin() + 1);
  }
  kept_.back().add(role, breach);
}

void Incidents::correct(Role role, const Breach& breach) {
  for (Incident& incident : kept_) incident.correct(role, breach);
}

}  // namespace hotpath::watch
