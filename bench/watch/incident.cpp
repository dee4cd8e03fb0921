// SPDX-License-Identifier: Apache-2.0
#include "watch/incident.hpp"

#include <algorithm>
#include <ctime>
#include <tuple>

#include "program/text.hpp"

namespace hotpath::watch {

Duration realtime_now() {
  using namespace std::chrono;
  return system_clock::now().time_since_epoch() - steady_clock::now().time_since_epoch();
}

std::string time_of_day(Time at, Duration realtime) {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at.time_since_epoch() + realtime);
  const auto s = std::chrono::floor<std::chrono::seconds>(ms);
  const std::time_t seconds = s.count();
  std::tm local{};
  localtime_r(&seconds, &local);
  return program::text("%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                       static_cast<int>((ms - s).count()));
}

std::string shown_ms(Duration duration) { return program::fixed(to_ms(duration), 3) + " ms"; }

namespace {

/// In this order a fact is what broke first: a standstill precedes terms, and these circumstances.
auto order_of(const Fact& fact) {
  const bool is_term = fact.role != Role::standstill && fact.role != Role::circumstance;
  return std::tuple(is_term ? Role::assumption : fact.role, fact.at, fact.role);
}

}  // namespace

void Incident::insert(Fact fact) {
  facts_.insert(std::ranges::upper_bound(facts_, fact.at, {}, &Fact::at), std::move(fact));
}

void Incident::add(Fact breach, bool is_new) {
  last_ = std::max(last_, breach.until);
  breaches_ += is_new ? 1 : 0;
  const auto same =
      std::ranges::find_if(facts_, [&](const Fact& f) { return f.term != nullptr && f.term == breach.term; });
  if (same != facts_.end() && order_of(*same) < order_of(breach)) return;
  const bool is_first =
      facts_.empty() || order_of(breach) < order_of(first()) || (same != facts_.end() && &*same == &first());
  if (same != facts_.end()) facts_.erase(same);
  if (is_first) {
    std::erase_if(facts_, [](const Fact& f) { return f.role == Role::circumstance; });
    described_ = false;
  }
  if (is_first || facts_.size() < kMostFacts) insert(std::move(breach));
}

void Incident::describe(const std::vector<Fact>& circumstances) {
  for (const Fact& fact : circumstances) insert(fact);
  described_ = news_ = true;
}

const Fact& Incident::first() const { return *std::ranges::min_element(facts_, {}, order_of); }

std::string Incident::stated(const Fact& fact) const {
  return time_of_day(fact.at, realtime_) + " " + fact.sentence;
}

std::vector<std::string> Incident::facts() const {
  std::vector<std::string> others;
  for (const Fact& fact : facts_)
    if (&fact != &first()) others.push_back(stated(fact));
  return others;
}

nlohmann::json Incident::json() const {
  return {{"number", number_},
          {"at", time_of_day(first().at, realtime_)},
          {"last", time_of_day(last_, realtime_)},
          {"breaches", breaches_},
          {"incident", text()},
          {"facts", facts()}};
}

void Incidents::add(Fact breach, bool is_new) {
  if (kept_.empty() || breach.at > kept_.back().last() + kPause) {
    kept_.emplace_back(count() + 1, realtime_);
    if (kept_.size() > kMost) kept_.erase(kept_.begin() + 1);
  }
  kept_.back().add(std::move(breach), is_new);
}

}  // namespace hotpath::watch
