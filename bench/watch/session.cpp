// SPDX-License-Identifier: Apache-2.0
#include "watch/session.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>

#include "machine/proc_files.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

namespace {

std::string random_name() {
  std::array<unsigned long long, sensor::kSessionDigits / 16> numbers{};
  if (getrandom(numbers.data(), sizeof numbers, 0) != static_cast<ssize_t>(sizeof numbers))
    throw program::RunError(std::string("no random numbers: ") + std::strerror(errno));
  return program::text("%016llx%016llx", numbers[0], numbers[1]);
}

std::string marker_of(const std::string& session) { return sensor::kNamePrefix + session; }

/// What follows `prefix` in the names of shared memory objects.
std::vector<std::string> names_after(const std::string& prefix) {
  std::vector<std::string> names;
  for (const std::string& file : machine::names_in("/dev/shm"))
    if (const std::string name = "/" + file; name.starts_with(prefix))
      names.push_back(name.substr(prefix.size()));
  return names;
}

/// The names of the rings of a session.
std::vector<std::string> rings_of(const std::string& session) {
  const std::string prefix = marker_of(session) + ".";
  std::vector<std::string> names;
  for (const std::string& name : names_after(prefix))
    if (session == sensor::kAttachable || name.size() == sensor::kRandomDigits)
      names.push_back(prefix + name);
  return names;
}

/// Removes what killed watchers left behind.
void remove_abandoned() {
  for (const std::string& session : names_after(sensor::kNamePrefix)) {
    const bool is_session = session.size() == sensor::kSessionDigits &&
                            session.find_first_not_of("0123456789abcdef") == std::string::npos;
    if (!is_session) continue;
    const int marker = shm_open(marker_of(session).c_str(), O_RDWR, 0);
    if (marker < 0) continue;  // of another user
    if (flock(marker, LOCK_EX | LOCK_NB) == 0) {
      for (const std::string& ring : rings_of(session)) shm_unlink(ring.c_str());
      shm_unlink(marker_of(session).c_str());
    }
    close(marker);
  }
}

/// Threads of attachable programs share the lock for a moment, to see whether a watcher has it.
bool lock(int marker) {
  for (int attempt = 0; attempt < 10; ++attempt) {
    if (flock(marker, LOCK_EX | LOCK_NB) == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

bool lives(std::uint32_t process) { return kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH; }

}  // namespace

Session::Session(Meeting meeting) : meeting_(meeting) {
  remove_abandoned();
  create_marker();
}

void Session::create_marker() {
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

Session::~Session() {
  shm_unlink(marker_name_.c_str());
  close(marker_);
  if (meeting_ == Meeting::attachable) return;
  for (const std::string& ring : rings_of(name_)) shm_unlink(ring.c_str());
}

void Session::find_rings() {
  found_.clear();
  const std::vector<std::string> names = rings_of(name_);
  std::erase_if(known_, [&](const std::string& name) { return std::ranges::count(names, name) == 0; });
  for (const std::string& name : names) {
    if (known_.contains(name)) continue;
    MappedRing memory = map_ring(name);
    if (!memory) continue;  // not complete yet, or of another user
    Source& source = sources_.emplace_back(name, std::move(memory));
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

void Session::read(tracing::Time now) {
  const bool attached = meeting_ == Meeting::attachable, first = passed_until_ == tracing::Time{};
  find_rings();
  std::erase_if(sources_, [&](Source& source) {
    RingReader& reader = source.reader;
    const bool alive = lives(reader.process());
    const bool last = reader.ended() || !alive;  // before the events are read
    reader.read(now, texts_, pending_);
    if (attached && first && !reader.describes())
      source.dropped_before = reader.dropped();  // a ring that was full had no room until now
    if (!last) return false;
    if (!reader.ended() && !reader.describes()) broken_off_.insert(reader.process());
    count(ended_, source);
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

const std::vector<tracing::Event>& Session::pass_on(tracing::Time until) {
  const auto end = std::ranges::lower_bound(pending_, until, {}, &tracing::Event::at);
  passed_.assign(pending_.begin(), end);
  pending_.erase(pending_.begin(), end);
  for (const tracing::Event& event : passed_) {
    const bool described = meeting_ == Meeting::attachable && describes(event.kind);
    late_ += event.at < passed_until_ && !described ? 1 : 0;
  }
  passed_until_ = std::max(passed_until_, until);
  return passed_;
}

bool Session::broke_off(std::uint32_t process) const {
  return broken_off_.contains(process) || std::ranges::any_of(sources_, [&](const Source& source) {
           return source.reader.process() == process && !source.reader.ended() && !source.reader.describes();
         });
}

void Session::count(Losses& losses, const Source& source) {
  losses.dropped += source.reader.dropped() - source.dropped_before;
  losses.damaged += source.reader.damaged();
}

Losses Session::losses() const {
  Losses losses = ended_;
  losses.late = late_;
  for (const Source& source : sources_) count(losses, source);
  return losses;
}

}  // namespace hotpath::watch
