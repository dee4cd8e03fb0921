// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "watch/contract.hpp"

namespace hotpath::watch {

/// Shows instants as times of day, also after the real-time clock was set.
class WallClock {
 public:
  /// `offset`: the real-time clock minus that of Time.
  explicit WallClock(Duration offset) : offsets_{{Time::min(), offset}} {}
  /// Of this moment.
  [[nodiscard]] static WallClock now();

  [[nodiscard]] Duration offset() const { return offsets_.back().second; }

  /// From this instant on the offset is that of `clock`.
  void follow(const WallClock& clock, Time from);

  /// Local time, `12:00:01.123`, by the offset of that instant.
  [[nodiscard]] std::string text(Time at) const;

 private:
  /// Adjustments below this are those of a clock that runs on.
  static constexpr Duration kStep = std::chrono::milliseconds(1);
  static constexpr std::size_t kMost = 1000;

  std::deque<std::pair<Time, Duration>> offsets_;  // by the instant of their beginning
};

class JudgedTerm;
/// A thread by the ids of its process and of itself.
using ThreadKey = std::pair<std::uint32_t, std::uint32_t>;

/// A broken term at the instant of the breach.
struct Breach {
  Time at{};
  std::string sentence;                  ///< `Filter ran 6.1 ms, budget 5.0 ms (measured)`.
  const JudgedTerm* term = nullptr;      ///< That is broken; its lifetime is that of the contract.
  Duration excess = {};                  ///< By which a duration exceeded its limit; 0: it is no duration.
  Time since = {}, until = {};           ///< When that duration began, and when it ended or was judged.
  std::optional<ThreadKey> thread = {};  ///< The only thread whose waits can explain the breach.

  /// Whether both are of one duration, of which one was judged before its end.
  [[nodiscard]] bool continues(const Breach& other) const {
    return term == other.term && at == other.at && since == other.since && excess > Duration::zero();
  }
};

/// Breaches that followed one another: the first broken assumption, exceeded bound and missed
/// requirement.
class Incident {
 public:
  explicit Incident(std::uint64_t number) : number_(number) {}

  void add(Role role, const Breach& breach);
  /// A duration that was judged before its end has ended: the incident goes on until then, and its first
  /// breach of the role is corrected, if it is this one.
  void correct(Role role, const Breach& breach);

  /// Counts the incidents of a system from 1.
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] Time last() const { return last_; }
  [[nodiscard]] std::uint64_t breaches() const { return breaches_; }
  /// Counts how often the first breach of a role changed, and so the text.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }
  [[nodiscard]] const std::optional<Breach>& first(Role role) const {
    return first_[static_cast<std::size_t>(role)];
  }
  /// The first of all roles.
  [[nodiscard]] const Breach& begin() const;
  /// Cause and effect in one sentence. `unseen`: an assumption that could not be observed, if there is
  /// one.
  [[nodiscard]] std::string text(const WallClock& clock, const std::string& unseen) const;

 private:
  [[nodiscard]] const std::optional<Breach>& effect() const;

  std::uint64_t number_;
  std::array<std::optional<Breach>, 3> first_;  // by role
  Time last_ = Time::min();
  std::uint64_t breaches_ = 0, changes_ = 0;
};

/// The incidents of a system: an incident ends when no term breaks for kPause.
class Incidents {
 public:
  static constexpr Duration kPause = std::chrono::seconds(2);
  static constexpr std::size_t kMost = 100;

  void add(Role role, const Breach& breach);
  /// A duration that was judged before its end has ended.
  void correct(Role role, const Breach& breach);

  /// The first one and the latest kMost - 1, in the order of time.
  [[nodiscard]] const std::deque<Incident>& kept() const { return kept_; }
  [[nodiscard]] std::uint64_t count() const { return kept_.empty() ? 0 : kept_.back().number(); }

 private:
  std::deque<Incident> kept_;
};

}  // namespace hotpath::watch
