// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/file.h>

#include <cerrno>
#include <chrono>
#include <list>
#include <random>
#include <set>
#include <thread>

#include "machine/proc_files.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "watch/flight_recorder.hpp"
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
  explicit Session(Meeting meeting = Meeting::own) : meeting_(meeting) {
    remove_abandoned();
    create_marker();
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Programs that go on notice the end of the session and create no further rings.
  ~Session() {
    shm_unlink(marker_name_.c_str());
    close(marker_);
    if (meeting_ == Meeting::own) remove_rings(name_);
  }

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

  [[nodiscard]] Losses losses() const {
    Losses losses = losses_;
    for (const Source& source : sources_) source.count(losses);
    return losses;
  }
  /// The processes of the rings that the last call of poll() found.
  [[nodiscard]] const std::set<std::uint32_t>& found() const { return found_; }
  /// Threads that called tracepoints so far.
  [[nodiscard]] std::uint64_t threads() const { return threads_; }
  /// Whether a thread of the process that called tracepoints did not end by itself.
  [[nodiscard]] bool broke_off(std::uint32_t process) const {
    return broken_off_.contains(process) || std::ranges::any_of(sources_, [&](const Source& source) {
             return source.reader.process() == process && source.goes_on();
           });
  }

  static constexpr auto kSettled = std::chrono::milliseconds(50);

 private:
  struct Source {
    std::string name;
    MappedRing memory;
    RingReader reader{*memory};
    std::uint64_t dropped_before = 0;  ///< Before the session.

    void count(Losses& losses) const {
      losses.dropped += reader.dropped() - dropped_before;
      losses.damaged += reader.damaged();
    }
    /// Its thread, of which it has jobs, has not ended by itself.
    [[nodiscard]] bool goes_on() const { return !reader.ended() && !reader.describes(); }
  };

  /// sensor::kSessionDigits hexadecimal digits.
  static std::string random_name() {
    std::random_device random;
    return program::text("%08x%08x%08x%08x", random(), random(), random(), random());
  }
  static std::string marker_of(const std::string& session) { return sensor::kNamePrefix + session; }
  /// What follows `prefix` in the names of shared memory objects.
  static std::vector<std::string> names_after(const std::string& prefix) {
    std::vector<std::string> names;
    for (const std::string& file : machine::names_in("/dev/shm"))
      if (const std::string name = "/" + file; name.starts_with(prefix))
        names.push_back(name.substr(prefix.size()));
    return names;
  }
  /// The names of the rings of a session.
  static std::vector<std::string> rings_of(const std::string& session) {
    const std::string prefix = marker_of(session) + ".";
    std::vector<std::string> names;
    for (const std::string& name : names_after(prefix))
      if (session == sensor::kAttachable || name.size() == sensor::kRandomDigits)
        names.push_back(prefix + name);
    return names;
  }
  static void remove_rings(const std::string& session) {
    for (const std::string& ring : rings_of(session)) shm_unlink(ring.c_str());
  }
  /// Removes what killed watchers left behind.
  static void remove_abandoned() {
    for (const std::string& session : names_after(sensor::kNamePrefix)) {
      const bool is_session = session.size() == sensor::kSessionDigits &&
                              session.find_first_not_of("0123456789abcdef") == std::string::npos;
      if (!is_session) continue;
      const int marker = shm_open(marker_of(session).c_str(), O_RDWR, 0);
      if (marker < 0) continue;  // of another user
      if (flock(marker, LOCK_EX | LOCK_NB) == 0) {
        remove_rings(session);
        shm_unlink(marker_of(session).c_str());
      }
      close(marker);
    }
  }
  /// Threads of attachable programs share the lock for a moment, to see whether a watcher has it.
  static bool lock(int marker) {
    for (int attempt = 0; attempt < 10; ++attempt) {
      if (flock(marker, LOCK_EX | LOCK_NB) == 0) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  void create_marker() {
    const bool own = meeting_ == Meeting::own;
    struct stat status {};
    do {  // a watcher that starts at the same time may take it for abandoned; one that ends removes its own
      if (marker_ >= 0) close(marker_);
      name_ = own ? random_name() : sensor::kAttachable;
      marker_name_ = own ? marker_of(name_) : program::concat(sensor::kAttachedPrefix, geteuid());
      marker_ = shm_open(marker_name_.c_str(), O_RDWR | O_CREAT | (own ? O_EXCL : O_NOFOLLOW), 0600);
      if (marker_ < 0 || (own && flock(marker_, LOCK_EX) != 0) || fstat(marker_, &status) != 0)
        throw program::RunError((own ? "no shared memory for the sensor in /dev/shm: "
                                     : "cannot attach: /dev/shm" + marker_name_ + ": ") +
                                std::strerror(errno));
      if (!own && !lock(marker_)) {
        close(marker_);
        throw program::RunError(
            "another `hotpath watch` is attached; end it first, or watch a program that you "
            "start: hotpath watch -- PROGRAM");
      }
    } while (fstat(marker_, &status) != 0 || status.st_nlink == 0);
  }
  void find_rings() {
    found_.clear();
    const std::vector<std::string> names = rings_of(name_);
    std::erase_if(known_, [&](const std::string& name) { return std::ranges::count(names, name) == 0; });
    for (const std::string& name : names) {
      if (known_.contains(name)) continue;
      MappedRing memory = RingMemory::map(name);
      if (!memory) continue;  // not complete yet, or of another user
      Source& source = sources_.emplace_back(Source{name, std::move(memory)});
      if (meeting_ == Meeting::own) {
        shm_unlink(name.c_str());
      } else {
        known_.insert(name);
        // A ring of descriptions lacks for ever what it had no room for.
        if (!source.reader.describes()) source.dropped_before = source.reader.dropped();
      }
      found_.insert(source.reader.process());
      threads_ += source.reader.describes() ? 0 : 1;
    }
  }
  void read(tracing::Time now) {
    const bool attached = meeting_ == Meeting::attachable, first = passed_until_ == tracing::Time{};
    find_rings();
    std::erase_if(sources_, [&](Source& source) {
      RingReader& reader = source.reader;
      const bool alive = kill(static_cast<pid_t>(reader.process()), 0) == 0 || errno != ESRCH;
      const bool last = reader.ended() || !alive;  // before the events are read
      reader.read(now, texts_, pending_);
      if (attached && first && !reader.describes())
        source.dropped_before = reader.dropped();  // a ring that was full had no room until now
      if (!last) return false;
      if (source.goes_on()) broken_off_.insert(reader.process());
      source.count(losses_);
      // Later watchers need the descriptions as long as the process lives.
      if (attached && (!alive || !reader.describes())) shm_unlink(source.name.c_str());
      return true;
    });
    // Jobs before the session began are of programs that were not watched then.
    std::erase_if(pending_, [&](const tracing::Event& event) {
      return attached && event.at < begin_ && !describes(event.kind);
    });
    std::ranges::stable_sort(pending_, {}, &tracing::Event::at);
  }
  const std::vector<tracing::Event>& pass_on(tracing::Time until) {
    const auto end = std::ranges::lower_bound(pending_, until, {}, &tracing::Event::at);
    passed_.assign(pending_.begin(), end);
    pending_.erase(pending_.begin(), end);
    for (const tracing::Event& event : passed_) {
      const bool described = meeting_ == Meeting::attachable && describes(event.kind);
      losses_.late += event.at < passed_until_ && !described ? 1 : 0;
    }
    passed_until_ = std::max(passed_until_, until);
    return passed_;
  }

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
  Losses losses_;  // of rings that are no longer read, and late events
  std::uint64_t threads_ = 0;
};

}  // namespace hotpath::watch
