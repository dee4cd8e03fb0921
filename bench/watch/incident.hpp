// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "watch/contract.hpp"

namespace hotpath::watch {

/// The real-time clock minus that of Time, at this moment.
[[nodiscard]] Duration realtime_now();
/// Local time, `12:00:01.123`. `realtime`: the real-time clock minus that of Time.
[[nodiscard]] std::string time_of_day(Time at, Duration realtime);

/// `5.000 ms`.
[[nodiscard]] std::string shown_ms(Duration duration);

class JudgedTerm;

/// What was observed of a system at one instant.
struct Fact {
  Role role;
  Time at{};
  std::string sentence;              ///< `Filter ran 6.1 ms, budget 5.0 ms (measured)`.
  const JudgedTerm* term = nullptr;  ///< That is broken; its lifetime is that of the contract.
  Time since = at, until = at;       ///< Begin and end of what the sentence tells.
};

/// Facts: what broke first, and what else was observed meanwhile.
class Incident {
 public:
  /// `realtime`: for times of day.
  Incident(std::uint64_t number, Duration realtime) : number_(number), realtime_(realtime) {}

  /// A broken term, of which only the first breach is a fact, or a standstill. `is_new`: false: a breach that
  /// was added before its end has ended.
  void add(Fact breach, bool is_new);
  /// Adds the circumstances of what broke first.
  void describe(const std::vector<Fact>& circumstances);
  /// Whether it has the circumstances of what broke first so far.
  [[nodiscard]] bool is_described() const { return described_; }

  /// Counts the incidents of a system from 1.
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] Time last() const { return last_; }
  [[nodiscard]] std::uint64_t breaches() const { return breaches_; }
  /// Whether what broke first has circumstances that it had not the last time.
  bool take_news() { return std::exchange(news_, false); }
  /// The first standstill, or else the first broken term.
  [[nodiscard]] const Fact& first() const;
  /// The instant and the sentence of what broke first.
  [[nodiscard]] std::string text() const { return stated(first()); }
  /// The same of all other facts, in the order of time.
  [[nodiscard]] std::vector<std::string> facts() const;
  [[nodiscard]] nlohmann::json json() const;

 private:
  static constexpr std::size_t kMostFacts = 20;
  void insert(Fact fact);
  [[nodiscard]] std::string stated(const Fact& fact) const;

  std::uint64_t number_;
  Duration realtime_;        // of its beginning: somebody may set the clock later
  std::vector<Fact> facts_;  // in the order of time
  Time last_ = Time::min();
  std::uint64_t breaches_ = 0;
  bool described_ = false, news_ = false;
};

/// The incidents of a system: an incident ends when no term breaks for kPause.
class Incidents {
 public:
  static constexpr Duration kPause = std::chrono::seconds(2);
  static constexpr std::size_t kMost = 100;

  /// `realtime`: of incidents that begin before set_realtime().
  explicit Incidents(Duration realtime = {}) : realtime_(realtime) {}
  void add(Fact breach, bool is_new = true);
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
