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

std::string WallClock::text(Time at) const {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at.time_since_epoch() + offset_);
  const auto s = std::chrono::floor<std::chrono::seconds>(ms);
  const std::time_t seconds = s.count();
  std::tm local{};
  localtime_r(&seconds, &local);
  return program::text("%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                       static_cast<int>((ms - s).count()));
}

void Incident::add(Role role, const Breach& breach) {
  std::optional<Breach>& first = first_[static_cast<std::size_t>(role)];
  if (!first || breach.at < first->at) first = breach;
}

bool Incident::any() const {
  return std::ranges::any_of(first_, [](const auto& first) { return first.has_value(); });
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

}  // namespace hotpath::watch
