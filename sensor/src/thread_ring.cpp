// SPDX-License-Identifier: Apache-2.0
#include "thread_ring.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>
#include <string_view>

namespace hotpath::sensor {

namespace {

/// A ring and the watcher's position in it when it was last read.
struct Place {
  Ring* ring = nullptr;
  std::uint64_t tail_seen = 0;
  bool tried = false;  ///< Never try twice to create it: the attempt costs system calls.
};

struct ThreadState {
  Place events;
  Place descriptions;        ///< Attachable programs: a ring of its own.
  std::uint64_t random = 0;  ///< Of the name of the ring of events.
  bool attachable = false;   ///< The session is kAttachable.
  bool lacks_ring = false;   ///< A watcher lives, but there was no room.
  bool writing = false;      ///< A signal handler may interrupt a write and call a tracepoint.
};
thread_local constinit ThreadState this_thread;

/// Calls of threads that lack a ring, until a thread that has one adds them to what it dropped.
std::atomic<std::uint64_t> unrecorded{0};

/// Room for `/hotpath_watch.SESSION.RANDOM`.
using Name = char[96];

pthread_key_t at_thread_end;
bool has_key = false;  // zero is a key as well
pthread_once_t prepared = PTHREAD_ONCE_INIT;

void name_ring(Name& name, const char* session, std::uint64_t random) {
  const auto digits = static_cast<unsigned long long>(random);
  if (std::strcmp(session, kAttachable) == 0) {
    std::snprintf(name, sizeof name, "%s%s.%d.%016llx", kNamePrefix, session, getpid(), digits);
  } else {
    std::snprintf(name, sizeof name, "%s%s.%016llx", kNamePrefix, session, digits);
  }
}

/// Whether a living watcher holds the lock of this object.
bool locked(const char* marker) {
  const int file = shm_open(marker, O_RDONLY, 0);
  if (file < 0) return false;
  const bool is_locked = flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(file);
  return is_locked;
}

/// Whether a watcher is attached, which removes the names of rings itself.
bool attached() {
  Name marker;
  std::snprintf(marker, sizeof marker, "%s%u", kAttachedPrefix, geteuid());
  return locked(marker);
}

void end(Place& place) {
  Ring* const ring = place.ring;
  place.ring = nullptr;  // later destructors may call tracepoints
  if (ring == nullptr) return;
  ring->ended.store(1, std::memory_order_release);
  munmap(ring, sizeof(Ring));
}

void end_thread(void*) {
  end(this_thread.events);
  end(this_thread.descriptions);  // keeps its name: a later watcher needs it
  if (!this_thread.attachable || attached()) return;
  Name name;
  name_ring(name, kAttachable, this_thread.random);
  shm_unlink(name);
}

std::atomic<bool> has_names{false};  // of an attachable process

/// A forked process inherits the mapping, but the ring belongs to its parent.
void forget_ring() {
  if (this_thread.events.ring != nullptr) munmap(this_thread.events.ring, sizeof(Ring));
  if (this_thread.descriptions.ring != nullptr) munmap(this_thread.descriptions.ring, sizeof(Ring));
  this_thread = {};
  has_names = false;
  unrecorded = 0;
}

/// Removes the names of attachable rings: those of this process, or those that killed processes left.
void remove_names(bool of_this_process) {
  DIR* const folder = opendir("/dev/shm");
  if (folder == nullptr) return;
  Name prefix;
  std::snprintf(prefix, sizeof prefix, "%s%s.", kNamePrefix, kAttachable);
  const std::string_view begin = prefix + 1;
  while (const dirent* const file = readdir(folder)) {
    if (!std::string_view(file->d_name).starts_with(begin)) continue;
    const auto process = static_cast<pid_t>(std::strtol(file->d_name + begin.size(), nullptr, 10));
    const bool lives = process <= 0 || kill(process, 0) == 0 || errno != ESRCH;
    if (of_this_process ? process == getpid() : !lives) shm_unlink(file->d_name);
  }
  closedir(folder);
}

/// At the end of the process. A watcher reads the last events, and removes the names then.
[[gnu::destructor]] void end_process() {
  if (has_names && !attached()) remove_names(true);
}

void prepare() {
  has_key = pthread_key_create(&at_thread_end, end_thread) == 0;
  pthread_atfork(nullptr, nullptr, forget_ring);
}

/// A mapped object of the right size whose memory is reserved, so that no write can fail; nullptr
/// if there is no room.
void* reserve(const char* name) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur < sizeof(Ring)) return nullptr;  // SIGXFSZ
  const int file = shm_open(name, O_RDWR | O_CREAT | O_EXCL, 0600);
  if (file < 0) return nullptr;
  void* memory = MAP_FAILED;
  if (posix_fallocate(file, 0, sizeof(Ring)) == 0)
    memory = mmap(nullptr, sizeof(Ring), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0);
  close(file);
  if (memory != MAP_FAILED) return memory;
  shm_unlink(name);
  return nullptr;
}

bool is_watched_session(const char* session) {
  if (std::strspn(session, "0123456789abcdef") != kSessionDigits || session[kSessionDigits] != '\0')
    return false;
  Name marker;
  std::snprintf(marker, sizeof marker, "%s%s", kNamePrefix, session);
  return locked(marker);
}

Ring* create_ring(const char* session, std::uint64_t magic) {
  pthread_once(&prepared, prepare);
  std::uint64_t random = 0;
  if (getrandom(&random, sizeof random, GRND_NONBLOCK) != sizeof random) return nullptr;
  Name name;
  name_ring(name, session, random);
  void* const memory = reserve(name);
  if (memory == nullptr) return nullptr;
  Ring* const ring = new (memory) Ring;  // new objects are zero; the constructor touches nothing else
  ring->process = static_cast<std::uint32_t>(getpid());
  ring->thread = static_cast<std::uint32_t>(gettid());
  std::atomic_ref(ring->magic).store(magic, std::memory_order_release);  // from now on it is valid
  if (has_key) pthread_setspecific(at_thread_end, ring);
  if (magic == kMagic) this_thread.random = random;
  return ring;
}

/// Calls `create` without a cancellation of the thread; keeps errno.
template <class Create>
Ring* undisturbed(Create create) {
  const int error = errno;
  int state = 0;
  pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &state);
  Ring* const ring = create();
  pthread_setcancelstate(state, nullptr);
  errno = error;
  return ring;
}

void try_once() {
  this_thread.events.tried = true;
  const char* const session = std::getenv(kSessionVariable);
  if (session == nullptr) return;
  this_thread.attachable = std::strcmp(session, kAttachable) == 0;
  this_thread.events.ring = undisturbed([&]() -> Ring* {
    const bool meets = this_thread.attachable || is_watched_session(session);
    Ring* const ring = meets ? create_ring(session, kMagic) : nullptr;
    this_thread.lacks_ring = meets && ring == nullptr;
    if (ring != nullptr && this_thread.attachable && !has_names.exchange(true)) remove_names(false);
    return ring;
  });
}

/// Where a record of this tracepoint goes.
Place& place_of(EventKind kind) {
  ThreadState& thread = this_thread;
  if (!thread.attachable || format_of(kind).role != EventRole::describes) return thread.events;
  if (!thread.descriptions.tried) {
    thread.descriptions.tried = true;
    thread.descriptions.ring = undisturbed([] { return create_ring(kAttachable, kDescriptionsMagic); });
  }
  return thread.descriptions;
}

/// Whether there is room for this number of records.
bool has_room(Place& place, std::uint64_t head, std::uint64_t records) {
  if (head + records - place.tail_seen <= kCapacity) return true;
  place.tail_seen = place.ring->tail.load(std::memory_order_acquire);
  return head + records - place.tail_seen <= kCapacity;
}

std::uint8_t text_records(const char* text) {
  const std::size_t records = (strnlen(text, kTextRecords * kTextBytes) + kTextBytes - 1) / kTextBytes;
  return static_cast<std::uint8_t>(records);
}

/// Writes a text into the ring from position `head` on.
void write_text(Ring& ring, std::uint64_t head, std::uint16_t which, const char* text) {
  std::size_t rest = strnlen(text, kTextRecords * kTextBytes);
  for (; rest > 0; ++head) {
    Record& record = ring.records[head % kCapacity];
    const std::size_t length = rest < kTextBytes ? rest : kTextBytes;
    record.kind = kText;
    record.length = static_cast<std::uint8_t>(length);
    record.which = which;
    std::memcpy(record.text, text, length);
    text += length;
    rest -= length;
  }
}

/// The ring's thread alone writes the number.
void drop(Ring& ring, std::uint64_t calls) {
  ring.dropped.store(ring.dropped.load(std::memory_order_relaxed) + calls, std::memory_order_relaxed);
}

void write(Place& place, EventKind kind, std::initializer_list<std::uint64_t> numbers,
           std::initializer_list<const char*> texts) {
  Ring& ring = *place.ring;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  std::uint8_t following = 0;
  for (const char* const text : texts)
    following = static_cast<std::uint8_t>(following + (text != nullptr ? text_records(text) : 0));
  const std::uint64_t head = ring.head.load(std::memory_order_relaxed);
  if (unrecorded.load(std::memory_order_relaxed) != 0)
    drop(ring, unrecorded.exchange(0, std::memory_order_relaxed));
  if (!has_room(place, head, 1U + following)) return drop(ring, 1);
  Record& record = ring.records[head % kCapacity];
  record.at_ns = now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
  record.kind = kind;
  record.texts = following;
  record.processor = static_cast<std::int16_t>(sched_getcpu());
  std::size_t n = 0;
  for (const std::uint64_t number : numbers) record.number[n++] = number;
  for (; n < 4; ++n) record.number[n] = 0;
  std::uint64_t next = head + 1;
  std::uint16_t which = 0;
  for (const char* const text : texts) {
    if (text != nullptr) {
      write_text(ring, next, which, text);
      next += text_records(text);
    }
    ++which;
  }
  ring.head.store(next, std::memory_order_release);
}

}  // namespace

bool active() {
  if (!this_thread.events.tried) try_once();
  if (this_thread.lacks_ring) unrecorded.fetch_add(1, std::memory_order_relaxed);
  return this_thread.events.ring != nullptr;
}

void record(EventKind kind, std::initializer_list<std::uint64_t> numbers,
            std::initializer_list<const char*> texts) {
  if (this_thread.writing || !active()) return;
  this_thread.writing = true;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  if (Place& place = place_of(kind); place.ring != nullptr) {
    write(place, kind, numbers, texts);
  } else {
    unrecorded.fetch_add(1, std::memory_order_relaxed);
  }
  std::atomic_signal_fence(std::memory_order_seq_cst);
  this_thread.writing = false;
}

}  // namespace hotpath::sensor
