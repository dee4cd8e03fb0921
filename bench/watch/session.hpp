// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <list>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hotpath/sensor/ring.hpp"
#include "hotpath/tracing/event.hpp"
#include "machine/proc_files.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

/// Which of the two kinds of rings it is (sensor::kMagic); another value: none, or not yet.
[[nodiscard]] inline std::uint64_t magic_of(sensor::Ring& ring) {
  return std::atomic_ref(ring.magic).load(std::memory_order_acquire);
}

/// Maps rings of watched programs into the memory of this process. A program may change or cut the memory
/// at any time: bytes beyond its end read as zero, instead of a SIGBUS.
class RingMemory {
 public:
  /// That are mapped at a time.
  static constexpr std::size_t kMostRings = 2048;

  /// The shared memory object of this name; nullptr: it is not (yet) a ring, belongs to another user, or too
  /// many rings are mapped.
  [[nodiscard]] static std::unique_ptr<sensor::Ring, RingMemory> map(const std::string& name) {
    [[maybe_unused]] static const int handled = [] {
      struct sigaction action {};
      action.sa_sigaction = replace_page;
      action.sa_flags = SA_SIGINFO;
      return sigaction(SIGBUS, &action, nullptr);
    }();
    const auto slot = std::ranges::find_if(mapped, [](const auto& ring) { return ring == 0; });
    const int file = slot == mapped.end() ? -1 : shm_open(name.c_str(), O_RDWR | O_NOFOLLOW, 0);
    if (file < 0) return nullptr;
    void* memory = MAP_FAILED;
    struct stat status {};
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
        status.st_size == sizeof(sensor::Ring))
      memory = mmap(nullptr, sizeof(sensor::Ring), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) return nullptr;
    *slot = reinterpret_cast<std::uintptr_t>(memory);
    std::unique_ptr<sensor::Ring, RingMemory> ring(static_cast<sensor::Ring*>(memory));
    const std::uint64_t magic = magic_of(*ring);
    if (magic != sensor::kMagic && magic != sensor::kDescriptionsMagic) ring.reset();
    return ring;
  }
  void operator()(sensor::Ring* ring) const {
    const auto at = reinterpret_cast<std::uintptr_t>(ring);
    *std::ranges::find_if(mapped, [&](const auto& other) { return other == at; }) = 0;
    munmap(ring, sizeof *ring);
  }

 private:
  static inline std::array<std::atomic<std::uintptr_t>, kMostRings> mapped;  // read by the signal handler

  /// Memory whose file was cut: puts a page of zeros in its place and continues.
  static void replace_page(int, siginfo_t* info, void*) {
    const auto at = reinterpret_cast<std::uintptr_t>(info->si_addr);
    const auto size = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    char* const page = static_cast<char*>(info->si_addr) - at % size;
    for (const std::atomic<std::uintptr_t>& ring : mapped) {
      const std::uintptr_t begin = ring.load(std::memory_order_relaxed);
      if (begin == 0 || at < begin || at >= begin + sizeof(sensor::Ring)) continue;
      void* const replaced =
          mmap(page, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
      if (replaced != MAP_FAILED) return;
    }
    std::signal(SIGBUS, SIG_DFL);  // another cause: the access is repeated and ends the program
  }
};
using MappedRing = std::unique_ptr<sensor::Ring, RingMemory>;

/// Keeps the texts of events, each once, for its own lifetime.
class Texts {
 public:
  /// Empty once kMost different texts were kept.
  const char* keep(std::string text) {
    if (const auto kept = texts_.find(text); kept != texts_.end()) return kept->c_str();
    return texts_.size() < kMost ? texts_.insert(std::move(text)).first->c_str() : "";
  }

 private:
  static constexpr std::size_t kMost = 100'000;  // nodes and topics of a system: some thousands
  std::unordered_set<std::string> texts_;
};

/// Reads the records of one ring. Any bytes in it are safe: what is no record is counted as
/// damaged. Descriptions stay in the ring for other readers. The ring must outlive the reader.
class RingReader {
 public:
  /// What an earlier reader of the same ring has read is not read again, except descriptions.
  explicit RingReader(sensor::Ring& ring)
      : describes(magic_of(ring) == sensor::kDescriptionsMagic),
        process(ring.process),
        thread(ring.thread),
        ring_(ring),
        tail_(describes ? 0 : ring.tail.load(std::memory_order_acquire)) {}

  /// Appends the events since the last call, in the order in which they were written. `now`: an
  /// event from more than a second later is damaged.
  void read(tracing::Time now, Texts& texts, std::vector<tracing::Event>& events) {
    const std::uint64_t head = ring_.head.load(std::memory_order_acquire);
    if (head - tail_ > sensor::kCapacity) {
      ++damaged_;
      tail_ = head;
    }
    while (tail_ != head) {
      tracing::Event event;
      const std::uint64_t records = read_group(head - tail_, now, texts, event);
      if (records > 0) events.push_back(event);
      damaged_ += records > 0 ? 0 : 1;
      tail_ += std::max<std::uint64_t>(records, 1);
    }
    if (!describes) ring_.tail.store(tail_, std::memory_order_release);
  }

  /// The thread has ended; no event follows those that are in the ring now.
  [[nodiscard]] bool ended() const { return ring_.ended.load(std::memory_order_acquire) != 0; }
  /// Events for which the ring had no room.
  [[nodiscard]] std::uint64_t dropped() const { return ring_.dropped.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

  const bool describes;
  const std::uint32_t process, thread;

 private:
  static constexpr std::int16_t kMostProcessors = 8192;  // CONFIG_NR_CPUS of Linux is at most this

  /// The record at a position, copied because the program may change it at any time.
  [[nodiscard]] sensor::Record copy_of(std::uint64_t position) const {
    sensor::Record record;
    std::memcpy(&record, &ring_.records[position % sensor::kCapacity], sizeof record);
    return record;
  }
  /// One event with its texts; returns the number of its records, or 0 if they are damaged.
  std::uint64_t read_group(std::uint64_t available, tracing::Time now, Texts& texts,
                           tracing::Event& event) const {
    const sensor::Record record = copy_of(tail_);
    const tracing::Time at{tracing::Duration(record.at_ns)};
    if (static_cast<std::size_t>(record.kind) >= sensor::kEvents.size() || record.texts >= available ||
        record.at_ns < 0 || at > now + std::chrono::seconds(1))
      return 0;
    const bool known = record.processor >= 0 && record.processor < kMostProcessors;
    event = {record.kind, process, thread, known ? record.processor : -1, at};
    std::copy_n(record.number, event.number.size(), event.number.begin());
    std::array<std::string, 2> parts;
    for (std::uint64_t i = 1; i <= record.texts; ++i) {
      const sensor::Record text = copy_of(tail_ + i);
      if (text.kind != sensor::kText || text.length > sensor::kTextBytes || text.which >= parts.size())
        return 0;
      parts[text.which].append(text.text, strnlen(text.text, text.length));
    }
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (!parts[i].empty()) event.text[i] = texts.keep(std::move(parts[i]));
    return 1U + record.texts;
  }

  sensor::Ring& ring_;
  std::uint64_t tail_ = 0, damaged_ = 0;
};

/// What the programs of a session lost or spoiled so far.
struct Losses {
  std::uint64_t dropped = 0;  ///< Events for which a ring had no room.
  std::uint64_t damaged = 0;  ///< Records that are none.
  std::uint64_t late = 0;     ///< Events that came after later ones had been passed on.
  [[nodiscard]] std::uint64_t total() const { return dropped + damaged + late; }
};

/// Reads the events of programs that run with the sensor.
class Session {
 public:
  /// Removes what killed watchers and programs left behind, and creates the session's marker. `attached`: it
  /// reads the programs of this user that were started on their own, before or after it, instead of those
  /// that run with its random name. Throws RunError, also if another watcher is attached.
  explicit Session(bool attached = false) : attached_(attached) {
    remove_abandoned();
    create_marker();
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Programs that go on notice the end of the session and create no further rings.
  ~Session() {
    shm_unlink(marker_name_.c_str());
    close(marker_);
    if (!attached_) remove_rings(name_);
  }

  /// The value of sensor::kSessionVariable for the programs.
  [[nodiscard]] const std::string& name() const { return name_; }

  /// Reads what the programs have written, and passes on, in the order of time, events that happened
  /// kSettled or more before `now`: a thread may be displaced between reading the clock and writing
  /// the record. The result is valid until the next call; its texts live as long as the session.
  const std::vector<tracing::Event>& poll(tracing::Time now) { return pass_on(now, now - kSettled); }
  /// At the end: passes on all events that are left.
  const std::vector<tracing::Event>& finish(tracing::Time now) { return pass_on(now, tracing::Time::max()); }

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
             return source.reader.process == process && source.goes_on();
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
    [[nodiscard]] bool goes_on() const { return !reader.ended() && !reader.describes; }
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
  static std::vector<std::string> rings_of(const std::string& session) {
    const std::string prefix = marker_of(session) + ".";
    std::vector<std::string> names = names_after(prefix);
    if (session != sensor::kAttachable)
      std::erase_if(names, [](const std::string& name) { return name.size() != sensor::kRandomDigits; });
    for (std::string& name : names) name.insert(0, prefix);
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
    struct stat status {};
    do {  // a watcher that starts at the same time may take it for abandoned; one that ends removes its own
      if (marker_ >= 0) close(marker_);
      name_ = attached_ ? sensor::kAttachable : random_name();
      marker_name_ = attached_ ? program::concat(sensor::kAttachedPrefix, geteuid()) : marker_of(name_);
      marker_ = shm_open(marker_name_.c_str(), O_RDWR | O_CREAT | (attached_ ? O_NOFOLLOW : O_EXCL), 0600);
      if (marker_ < 0 || (!attached_ && flock(marker_, LOCK_EX) != 0) || fstat(marker_, &status) != 0)
        throw program::RunError((attached_ ? "cannot attach: /dev/shm" + marker_name_ + ": "
                                           : "no shared memory for the sensor in /dev/shm: ") +
                                std::strerror(errno));
      if (attached_ && !lock(marker_)) {
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
      if (!attached_) {
        shm_unlink(name.c_str());
      } else {
        known_.insert(name);
        // A ring of descriptions lacks for ever what it had no room for.
        if (!source.reader.describes) source.dropped_before = source.reader.dropped();
      }
      found_.insert(source.reader.process);
      threads_ += source.reader.describes ? 0 : 1;
    }
  }
  void read(tracing::Time now) {
    const bool first = passed_until_ == tracing::Time{};
    find_rings();
    std::erase_if(sources_, [&](Source& source) {
      RingReader& reader = source.reader;
      const bool alive = kill(static_cast<pid_t>(reader.process), 0) == 0 || errno != ESRCH;
      const bool last = reader.ended() || !alive;  // before the events are read
      reader.read(now, texts_, pending_);
      if (attached_ && first && !reader.describes)
        source.dropped_before = reader.dropped();  // a ring that was full had no room until now
      if (!last) return false;
      if (source.goes_on()) broken_off_.insert(reader.process);
      source.count(losses_);
      // Later watchers need the descriptions as long as the process lives.
      if (attached_ && (!alive || !reader.describes)) shm_unlink(source.name.c_str());
      return true;
    });
    // Jobs before the session began are of programs that were not watched then.
    std::erase_if(pending_, [&](const tracing::Event& event) {
      return attached_ && event.at < begin_ && !describes(event.kind);
    });
    std::ranges::stable_sort(pending_, {}, &tracing::Event::at);
  }
  const std::vector<tracing::Event>& pass_on(tracing::Time now, tracing::Time until) {
    read(now);
    const auto end = std::ranges::lower_bound(pending_, until, {}, &tracing::Event::at);
    passed_.assign(pending_.begin(), end);
    pending_.erase(pending_.begin(), end);
    for (const tracing::Event& event : passed_) {
      const bool late = event.at < passed_until_ && !(attached_ && describes(event.kind));
      losses_.late += late ? 1 : 0;
    }
    passed_until_ = std::max(passed_until_, until);
    return passed_;
  }

  const bool attached_;
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
