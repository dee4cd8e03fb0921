// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that makes one system call of `hotpath` and its processes fail.
// HOTPATH_CALLS names a file of kPlaces zeros of eight bytes, in which the library notes each
// calling place: a hash of the innermost callers and, in the upper bits, the kind of call (its
// number in kCalls plus 1). HOTPATH_FAIL=`PLACE ERRNO` makes the first call at that place fail with
// that error; ERRNO 0 makes a write end after half of its bytes. The first eight bytes of the file
// then become 1.
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

// clang-format off
constexpr const char* kCalls[] = {
    "malloc", "fork", "mmap", "open", "fopen", "write", "writev", "rename", "fsync", "mkdir",
    "socketpair", "send", "recv", "ppoll", "waitpid", "posix_spawnp", "pthread_create",
    "pthread_mutex_init", "socket", "bind", "setsockopt", "shm_open", "sched_setscheduler",
    "sched_getaffinity", "ftruncate", "flock"};
// clang-format on
constexpr std::size_t kCount = sizeof kCalls / sizeof *kCalls;

constexpr std::size_t number(const char* name) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (__builtin_strcmp(kCalls[i], name) == 0) return i;
  }
  __builtin_unreachable();
}

constexpr std::size_t kPlaces = 1 << 16;
constexpr int kCallers = 8;          // number of callers that identify a place
constexpr int kCallersOfMalloc = 3;  // fewer, as thousands of places call malloc
constexpr unsigned kHashBits = 48;

std::atomic<std::uint64_t>* places = nullptr;  // shared with all processes of the run
std::uint64_t failing_place = 0;
int failing_error = 0;

/// Runs before any other code of the program, and uses none of the functions replaced below.
__attribute__((constructor)) void begin() {
  const char* const file = getenv("HOTPATH_CALLS");
  if (file == nullptr || strcmp(program_invocation_short_name, "hotpath") != 0) return;
  const auto descriptor = static_cast<int>(syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC));
  if (descriptor < 0) return;
  const long memory = syscall(SYS_mmap, nullptr, kPlaces * sizeof(std::uint64_t), PROT_READ | PROT_WRITE,
                              MAP_SHARED, descriptor, 0);
  close(descriptor);
  if (const char* const plan = getenv("HOTPATH_FAIL")) {
    if (sscanf(plan, "%lu %d", &failing_place, &failing_error) != 2) abort();
  }
  void* callers[1];
  backtrace(callers, 1);  // its first call loads a library
  places = reinterpret_cast<std::atomic<std::uint64_t>*>(memory);
}

/// Identical in every run: hashes the callers' offsets within their files.
__attribute__((noinline)) std::uint64_t place_of(std::size_t call) {
  constexpr int kOwn = 3;  // this function, fails() and the call
  void* callers[kOwn + kCallers];
  const int count = backtrace(callers, kOwn + (call == number("malloc") ? kCallersOfMalloc : kCallers));
  std::uint64_t hash = 14695981039346656037U;
  for (int i = kOwn; i < count; ++i) {
    dl_find_object found{};
    if (_dl_find_object(callers[i], &found) != 0) continue;
    const auto at =
        reinterpret_cast<std::uintptr_t>(callers[i]) - reinterpret_cast<std::uintptr_t>(found.dlfo_map_start);
    hash = (hash ^ at) * 1099511628211U;
  }
  return (hash >> (64 - kHashBits)) | (call + 1) << kHashBits;
}

/// Inserts the place with open addressing; entry 0 of the table is the mark that the fault was
/// injected.
void note(std::uint64_t place) {
  for (std::size_t i = place % (kPlaces - 1), tried = 0; tried < kPlaces - 1; ++tried) {
    std::uint64_t there = 0;
    if (places[1 + i].compare_exchange_strong(there, place) || there == place) return;
    i = (i + 1) % (kPlaces - 1);
  }
  abort();
}

/// Notes the place. Returns true and sets errno for the call that must fail.
__attribute__((noinline)) bool fails(std::size_t call) {
  static thread_local bool inside = false;  // true during the search for callers, which may allocate
  if (places == nullptr || inside) return false;
  inside = true;
  const std::uint64_t place = place_of(call);
  note(place);
  inside = false;
  const bool chosen = place == failing_place && places[0].exchange(1) == 0;
  if (chosen) errno = failing_error;
  return chosen;
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t size);
void* malloc(size_t size) { return fails(number("malloc")) ? nullptr : __libc_malloc(size); }

#define REPLACED(Type, name, failure, parameters, arguments)                                \
  Type name parameters {                                                                    \
    static const auto real = reinterpret_cast<Type(*) parameters>(dlsym(RTLD_NEXT, #name)); \
    return fails(number(#name)) ? failure : real arguments;                                 \
  }
// clang-format off
REPLACED(pid_t, fork, -1, (), ())
REPLACED(void*, mmap, MAP_FAILED, (void* at, size_t size, int rights, int flags, int file, off_t offset), (at, size, rights, flags, file, offset))
REPLACED(FILE*, fopen, nullptr, (const char* path, const char* mode), (path, mode))
REPLACED(int, rename, -1, (const char* from, const char* to), (from, to))
REPLACED(int, fsync, -1, (int file), (file))
REPLACED(int, mkdir, -1, (const char* path, mode_t mode), (path, mode))
REPLACED(int, socketpair, -1, (int domain, int type, int protocol, int* ends), (domain, type, protocol, ends))
REPLACED(ssize_t, send, -1, (int socket, const void* data, size_t size, int flags), (socket, data, size, flags))
REPLACED(ssize_t, recv, -1, (int socket, void* data, size_t size, int flags), (socket, data, size, flags))
REPLACED(int, ppoll, -1, (pollfd* files, nfds_t count, const timespec* wait, const sigset_t* mask), (files, count, wait, mask))
REPLACED(pid_t, waitpid, -1, (pid_t process, int* status, int flags), (process, status, flags))
REPLACED(int, posix_spawnp, failing_error, (pid_t* id, const char* file, const posix_spawn_file_actions_t* actions, const posix_spawnattr_t* attributes, char* const* arguments, char* const* environment), (id, file, actions, attributes, arguments, environment))
REPLACED(int, pthread_create, failing_error, (pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument), (thread, attributes, run, argument))
REPLACED(int, pthread_mutex_init, failing_error, (pthread_mutex_t* mutex, const pthread_mutexattr_t* attributes), (mutex, attributes))
REPLACED(int, socket, -1, (int domain, int type, int protocol), (domain, type, protocol))
REPLACED(int, setsockopt, -1, (int socket, int level, int name, const void* value, socklen_t size), (socket, level, name, value, size))
REPLACED(int, bind, -1, (int socket, const sockaddr* address, socklen_t size), (socket, address, size))
REPLACED(int, shm_open, -1, (const char* name, int flags, mode_t mode), (name, flags, mode))
REPLACED(int, ftruncate, -1, (int file, off_t size), (file, size))
REPLACED(int, sched_setscheduler, -1, (pid_t thread, int policy, const sched_param* parameters), (thread, policy, parameters))
REPLACED(int, sched_getaffinity, -1, (pid_t thread, size_t size, cpu_set_t* set), (thread, size, set))
REPLACED(int, flock, -1, (int file, int operation), (file, operation))
REPLACED(ssize_t, writev, -1, (int file, const iovec* parts, int count), (file, parts, count))
// clang-format on

ssize_t write(int file, const void* data, size_t size) {
  if (!fails(number("write"))) return syscall(SYS_write, file, data, size);
  return failing_error != 0 || size < 2 ? -1 : syscall(SYS_write, file, data, size / 2);
}

FILE* fopen64(const char* path, const char* mode) { return fopen(path, mode); }

int open(const char* path, int flags, ...) {
  if (fails(number("open"))) return -1;
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);  // without O_CREAT, garbage that is not used
  va_end(more);
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

}  // extern "C"
