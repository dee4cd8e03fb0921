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
#include <filesystem>

#include "program/errors.hpp"
#include "program/text.hpp"
#include "watch/mapped_ring.hpp"
#include "watch/ring_reader.hpp"

namespace hotpath::watch {

namespace {

namespace fs = std::filesystem;

std::string random_name() {
  std::array<unsigned char, sensor::kSessionDigits / 2> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw program::RunError(std::string("no random numbers: ") + std::strerror(errno));
  std::string name;
  for (const unsigned char byte : bytes) {
    name += "0123456789abcdef"[byte >> 4];
    name += "0123456789abcdef"[byte & 15];
  }
  return name;
}

std::string marker_of(const std::string& session) { return sensor::kNamePrefix + session; }

/// The names of the rings of a session which wait for a reader.
std::vector<std::string> new_rings(const std::string& session) {
  const std::string prefix = marker_of(session) + ".";
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator at("/dev/shm", error);
  for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
    std::string name = "/" + at->path().filename().string();
    if (name.starts_with(prefix) && name.size() == prefix.size() + sensor::kRandomDigits)
      names.push_back(std::move(name));
  }
  return names;
}

/// Removes what killed watchers left behind.
void remove_abandoned() {
  const std::string prefix = std::string(sensor::kNamePrefix).substr(1);
  std::vector<std::string> sessions;
  std::error_code error;
  fs::directory_iterator at("/dev/shm", error);
  for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(prefix) && name.size() == prefix.size() + sensor::kSessionDigits)
      sessions.push_back(name.substr(prefix.size()));
  }
  for (const std::string& session : sessions) {
    const int marker = shm_open(marker_of(session).c_str(), O_RDWR, 0);
    if (marker < 0) continue;  // of another user
    if (flock(marker, LOCK_EX | LOCK_NB) == 0) {
      for (const std::string& ring : new_rings(session)) shm_unlink(ring.c_str());
      shm_unlink(marker_of(session).c_str());
    }
    close(marker);
  }
}

bool lives(std::uint32_t process) { return kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH; }

}  // namespace

struct Session::Source {
  explicit Source(const std::string& name) : memory(name) {
    if (memory.get() != nullptr) reader = std::make_unique<RingReader>(*memory.get());
  }
  MappedRing memory;
  std::unique_ptr<RingReader> reader;
};

Session::Session() {
  remove_abandoned();
  struct stat status {};
  do {  // a watcher that starts at the same time may take the marker for an abandoned one
    if (marker_ >= 0) close(marker_);
    name_ = random_name();
    marker_ = shm_open(marker_of(name_).c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
    if (marker_ < 0 || flock(marker_, LOCK_EX) != 0 || fstat(marker_, &status) != 0)
      throw program::RunError(
          program::concat("no shared memory for the sensor in /dev/shm: ", std::strerror(errno)));
  } while (status.st_nlink == 0);
}

Session::~Session() {
  close(marker_);
  shm_unlink(marker_of(name_).c_str());
  for (const std::string& ring : new_rings(name_)) shm_unlink(ring.c_str());
}

void Session::find_rings() {
  for (const std::string& name : new_rings(name_)) {
    auto source = std::make_unique<Source>(name);
    if (!source->reader) continue;  // not complete yet
    shm_unlink(name.c_str());
    sources_.push_back(std::move(source));
    ++threads_;
  }
}

void Session::read(tracing::Time now) {
  find_rings();
  std::erase_if(sources_, [&](const std::unique_ptr<Source>& source) {
    RingReader& reader = *source->reader;
    const bool last = reader.ended() || !lives(reader.process());  // before the events are read
    reader.read(now, texts_, pending_);
    if (!last) return false;
    ended_.dropped += reader.dropped();
    ended_.damaged += reader.damaged();
    return true;
  });
  std::ranges::stable_sort(pending_, {}, &tracing::Event::at);
}

const std::vector<tracing::Event>& Session::pass_on(tracing::Time until) {
  const auto end = std::ranges::lower_bound(pending_, until, {}, &tracing::Event::at);
  passed_.assign(pending_.begin(), end);
  pending_.erase(pending_.begin(), end);
  for (const tracing::Event& event : passed_) late_ += event.at < passed_until_ ? 1 : 0;
  passed_until_ = std::max(passed_until_, until);
  return passed_;
}

const std::vector<tracing::Event>& Session::poll(tracing::Time now) {
  read(now);
  return pass_on(now - kSettled);
}

const std::vector<tracing::Event>& Session::finish(tracing::Time now) {
  read(now);
  return pass_on(tracing::Time::max());
}

Losses Session::losses() const {
  Losses losses = ended_;
  losses.late = late_;
  for (const std::unique_ptr<Source>& source : sources_) {
    losses.dropped += source->reader->dropped();
    losses.damaged += source->reader->damaged();
  }
  return losses;
}

}  // namespace hotpath::watch
