// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "program/text.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

/// Local time, `12:00:01.123`. `realtime`: the real-time clock minus that of Time.
[[nodiscard]] inline std::string time_of_day(Time at, Duration realtime) {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at.time_since_epoch() + realtime);
  const auto s = std::chrono::floor<std::chrono::seconds>(ms);
  const std::time_t seconds = s.count();
  std::tm local{};
  localtime_r(&seconds, &local);
  return program::text("%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                       static_cast<int>((ms - s).count()));
}

/// `5.000 ms`.
[[nodiscard]] inline std::string shown_ms(Duration duration) {
  return program::fixed(to_ms(duration), 3) + " ms";
}

class JudgedTerm;

/// What was observed of a system at one instant.
struct Fact {
  Role role;
  Time at{};
  std::string sentence;              ///< `Filter ran 6.1 ms, budget 5.0 ms (measured)`.
  const JudgedTerm* term = nullptr;  ///< That is broken; its lifetime is that of the contract.
  Time since = at, until = at;       ///< Begin and end of what the sentence tells.

  [[nodiscard]] bool is_term() const { return role >= Role::assumption && role != Role::circumstance; }
};

/// Facts: what broke first, and what else was observed meanwhile.
class Incident {
 public:
  /// `number`: counts the incidents of a system from 1. `realtime`: for times of day.
  Incident(std::uint64_t number, Duration realtime) : number_(number), realtime_(realtime) {}

  /// A broken term, of which only the first breach is a fact, or what is more severe. `is_new`: false: a
  /// breach that was added before its end has ended.
  void add(Fact breach, bool is_new) {
    last_ = std::max(last_, breach.until);
    breaches_ += is_new ? 1 : 0;
    const auto same =
        std::ranges::find_if(facts_, [&](const Fact& f) { return f.term && f.term == breach.term; });
    const bool again = same != facts_.end();
    if (again && order_of(*same) < order_of(breach)) return;
    const bool is_first =
        facts_.empty() || order_of(breach) < order_of(first()) || (again && &*same == &first());
    if (again) facts_.erase(same);
    if (is_first) std::erase_if(facts_, [](const Fact& f) { return f.role == Role::circumstance; });
    described_ = described_ && !is_first;
    if (is_first || breach.term || facts_.size() < kMostFacts) insert(std::move(breach));
  }
  /// Adds the circumstances of what broke first.
  void describe(const std::vector<Fact>& circumstances) {
    for (const Fact& fact : circumstances) insert(fact);
    described_ = true;
  }
  /// Whether it has the circumstances of what broke first so far.
  [[nodiscard]] bool is_described() const { return described_; }

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] Time last() const { return last_; }
  [[nodiscard]] std::uint64_t breaches() const { return breaches_; }
  /// The most severe fact, or else the first broken term.
  [[nodiscard]] const Fact& first() const { return *std::ranges::min_element(facts_, {}, order_of); }
  /// The instant and the sentence of what broke first.
  [[nodiscard]] std::string text() const { return stated(first()); }
  /// Less: it is more severe, or began earlier.
  [[nodiscard]] auto severity() const { return order_of(first()); }
  /// The same of all other facts, in the order of time.
  [[nodiscard]] std::vector<std::string> facts() const {
    std::vector<std::string> others;
    for (const Fact& fact : facts_)
      if (&fact != &first()) others.push_back(stated(fact));
    return others;
  }
  [[nodiscard]] nlohmann::json json() const {
    return {{"number", number_},
            {"at", time_of_day(first().at, realtime_)},
            {"last", time_of_day(last_, realtime_)},
            {"breaches", breaches_},
            {"incident", text()},
            {"facts", facts()}};
  }

 private:
  static constexpr std::size_t kMostFacts = 20;  // besides broken terms

  /// In this order a fact is what broke first: by severity, but terms by time.
  static std::tuple<Role, Time, Role> order_of(const Fact& fact) {
    return {fact.is_term() ? Role::assumption : fact.role, fact.at, fact.role};
  }
  void insert(Fact fact) {
    facts_.insert(std::ranges::upper_bound(facts_, fact.at, {}, &Fact::at), std::move(fact));
  }
  [[nodiscard]] std::string stated(const Fact& fact) const {
    return time_of_day(fact.at, realtime_) + " " + fact.sentence;
  }

  std::uint64_t number_;
  Duration realtime_;        // of its beginning: somebody may set the clock later
  std::vector<Fact> facts_;  // in the order of time
  Time last_ = Time::min();
  std::uint64_t breaches_ = 0;
  bool described_ = false;
};

/// The incidents of a system: an incident ends when no term breaks for kPause.
class Incidents {
 public:
  static constexpr Duration kPause = std::chrono::seconds(2);
  static constexpr std::size_t kMost = 100;

  /// `realtime`: of incidents that begin before set_realtime().
  explicit Incidents(Duration realtime = {}) : realtime_(realtime) {}
  void add(Fact breach, bool is_new = true) {
    if (kept_.empty() || breach.at > kept_.back().last() + kPause) {
      kept_.emplace_back(count() + 1, realtime_);
      if (kept_.size() > kMost) kept_.erase(kept_.begin() + 1);
    }
    kept_.back().add(std::move(breach), is_new);
  }
  /// Of incidents that begin from now on.
  void set_realtime(Duration offset) { realtime_ = offset; }
  [[nodiscard]] Duration realtime() const { return realtime_; }

  /// The first one and the latest kMost - 1, in the order of time.
  [[nodiscard]] std::deque<Incident>& kept() { return kept_; }
  [[nodiscard]] const std::deque<Incident>& kept() const { return kept_; }
  [[nodiscard]] std::uint64_t count() const { return kept_.empty() ? 0 : kept_.back().number(); }

 private:
  std::deque<Incident> kept_;
  Duration realtime_;
};

}  // namespace hotpath::watch
