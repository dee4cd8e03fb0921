// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "watch/contract.hpp"

namespace hotpath::watch {

/// Shows instants as times of day.
class WallClock {
 public:
  /// `offset`: the real-time clock minus that of Time.
  explicit WallClock(Duration offset) : offset_(offset) {}
  /// Of this moment.
  [[nodiscard]] static WallClock now();

  /// Local time, `12:00:01.123`.
  [[nodiscard]] std::string text(Time at) const;

 private:
  Duration offset_;
};

/// A broken term at the instant of the breach.
struct Breach {
  Time at{};
  std::string sentence;  ///< `Filter ran 6.1 ms, budget 5.0 ms (measured)`.
  Duration excess{};     ///< By which a bound was exceeded.
};

/// The first broken assumption, exceeded bound and missed requirement.
class Incident {
 public:
  void add(Role role, const Breach& breach);

  [[nodiscard]] const std::optional<Breach>& first(Role role) const {
    return first_[static_cast<std::size_t>(role)];
  }
  [[nodiscard]] bool any() const;
  /// Cause and effect in one sentence; empty: none of both. `unseen`: an assumption that could not be
  /// observed, if there is one.
  [[nodiscard]] std::string text(const WallClock& clock, const std::string& unseen) const;

 private:
  [[nodiscard]] const std::optional<Breach>& effect() const;

  std::array<std::optional<Breach>, 3> first_;  // by role
};

}  // namespace hotpath::watch
