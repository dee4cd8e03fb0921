// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <list>
#include <set>
#include <string>
#include <vector>

#include "hotpath/tracing/event.hpp"
#include "watch/ring_reader.hpp"

namespace hotpath::watch {

/// What the programs of a session lost or spoiled so far.
struct Losses {
  std::uint64_t dropped = 0;  ///< Events for which a ring had no room.
  std::uint64_t damaged = 0;  ///< Records that are none.
  std::uint64_t late = 0;     ///< Events that came after later ones had been passed on.
  [[nodiscard]] std::uint64_t total() const { return dropped + damaged + late; }
};

/// The programs that a session reads.
enum class Meeting : std::uint8_t {
  own,         ///< Those that run with the session's random name.
  attachable,  ///< Those of this user that were started on their own, before or after the session.
};

/// Reads the events of programs that run with the sensor.
class Session {
 public:
  /// Removes what killed watchers and programs left behind, and creates the session's marker. Throws
  /// RunError, also if another watcher is attached.
  explicit Session(Meeting meeting = Meeting::own);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Programs that go on notice the end of the session and create no further rings.
  ~Session();

  /// The value of sensor::kSessionVariable for the programs.
  [[nodiscard]] const std::string& name() const { return name_; }

  /// Reads what the programs have written, and passes on, in the order of time, events that happened
  /// kSettled or more before `now`: a thread may be displaced between reading the clock and writing
  /// the record. The result is valid until the next call; its texts live as long as the session.
  const std::vector<tracing::Event>& poll(tracing::Time now) {
    read(now);
    return pass_on(now - kSettled);
  }
  /// At the end: passes on all events that are left.
  const std::vector<tracing::Event>& finish(tracing::Time now) {
    read(now);
    return pass_on(tracing::Time::max());
  }

  [[nodiscard]] Losses losses() const;
  /// The processes of the rings that the last call of poll() found.
  [[nodiscard]] const std::set<std::uint32_t>& found() const { return found_; }
  /// Threads that called tracepoints so far.
  [[nodiscard]] std::uint64_t threads() const { return threads_; }

  /// Whether a thread of the process that called tracepoints did not end by itself.
  [[nodiscard]] bool broke_off(std::uint32_t process) const;

  static constexpr auto kSettled = std::chrono::milliseconds(50);

 private:
  struct Source {
    std::string name;
    MappedRing memory;
    RingReader reader{*memory};
    std::uint64_t dropped_before = 0;  ///< Before the session.
  };
  void create_marker();
  void find_rings();
  static void count(Losses& losses, const Source& source);
  void read(tracing::Time now);
  const std::vector<tracing::Event>& pass_on(tracing::Time until);

  const Meeting meeting_;
  const tracing::Time begin_ = std::chrono::steady_clock::now();
  std::string name_, marker_name_;
  int marker_ = -1;
  std::set<std::string> known_;  // attachable: names of rings that are or were read
  std::set<std::uint32_t> found_, broken_off_;
  std::list<Source> sources_;
  Texts texts_;
  std::vector<tracing::Event> pending_, passed_;
  tracing::Time passed_until_{};
  Losses ended_;  // of rings that are no longer read
  std::uint64_t threads_ = 0, late_ = 0;
};

}  // namespace hotpath::watch
