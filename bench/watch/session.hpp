// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/tracing/event.hpp"
#include "watch/texts.hpp"

namespace hotpath::watch {

/// What the programs of a session lost or spoiled so far.
struct Losses {
  std::uint64_t dropped = 0;  ///< Events for which a ring had no room.
  std::uint64_t damaged = 0;  ///< Records that are none.
  std::uint64_t late = 0;     ///< Events that came after later ones had been passed on.
};

/// Reads the events of all programs that run with the sensor and this session's name.
class Session {
 public:
  /// Removes what killed watchers left behind, and creates the session's marker. Throws RunError.
  Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Programs that go on notice the end of the session and create no further rings.
  ~Session();

  /// The value of sensor::kSessionVariable for the programs.
  [[nodiscard]] const std::string& name() const { return name_; }

  /// Reads what the programs have written, and passes on, in the order of time, events that happened
  /// kSettled or more before `now`: a thread may be displaced between reading the clock and writing
  /// the record. The result is valid until the next call; its texts live as long as the session.
  const std::vector<tracing::Event>& poll(tracing::Time now);
  /// At the end: passes on all events that are left.
  const std::vector<tracing::Event>& finish(tracing::Time now);

  [[nodiscard]] Losses losses() const;
  /// Threads that called tracepoints so far.
  [[nodiscard]] std::uint64_t threads() const { return threads_; }

  static constexpr auto kSettled = std::chrono::milliseconds(50);

 private:
  struct Source;
  void find_rings();
  void read(tracing::Time now);
  const std::vector<tracing::Event>& pass_on(tracing::Time until);

  std::string name_;
  int marker_ = -1;
  std::vector<std::unique_ptr<Source>> sources_;
  Texts texts_;
  std::vector<tracing::Event> pending_, passed_;
  tracing::Time passed_until_{};
  Losses ended_;  // of rings that are no longer read
  std::uint64_t threads_ = 0, late_ = 0;
};

}  // namespace hotpath::watch
