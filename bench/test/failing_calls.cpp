// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that lets one call of the command `hotpath` and its processes fail. HOTPATH_CALLS
// is a file of zeros in which each kind of call has a counter of eight bytes, in the order of kCalls.
// HOTPATH_FAIL=`NAME NUMBER ERRNO` lets the call with that number fail with that error; ERRNO 0 lets a write
// end after half of its bytes.
#include <dlfcn.h>
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

constexpr const char* kCalls[] = {"malloc",
                                  "fork",
                                  "mmap",
                                  "open",
                                  "fopen",
                                  "write",
                                  "writev",
                                  "rename",
                                  "fsync",
                                  "mkdir",
                                  "socketpair",
                                  "send",
                                  "recv",
                                  "ppoll",
                                  "waitpid",
                                  "posix_spawnp",
                                  "pthread_create",
                                  "pthread_mutex_init",
                                  "socket",
                                  "bind",
                                  "setsockopt",
                                  "shm_open",
                                  "sched_setscheduler",
                                  "sched_getaffinity",
                                  "ftruncate",
                                  "flock"};
constexpr std::size_t kCount = sizeof kCalls / sizeof *kCalls;

constexpr std::size_t place(const char* name) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (__builtin_strcmp(kCalls[i], name) == 0) return i;
  }
  __builtin_unreachable();
}

std::atomic<std::uint64_t>* counters = nullptr;  // shared with all processes of the run
std::size_t failing = kCount;
std::uint64_t failing_number = 0;
int failing_error = 0;

/// Before any other code of the program, and without a call that is replaced below.
__attribute__((constructor)) void begin() {
  const char* const file = getenv("HOTPATH_CALLS");
  if (file == nullptr || strcmp(program_invocation_short_name, "hotpath") != 0) return;
  const auto descriptor = static_cast<int>(syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC));
  if (descriptor < 0) return;
  const long memory = syscall(SYS_mmap, nullptr, kCount * sizeof(std::uint64_t), PROT_READ | PROT_WRITE,
                              MAP_SHARED, descriptor, 0);
  close(descriptor);
  if (const char* const plan = getenv("HOTPATH_FAIL")) {
    char name[64];
    unsigned long number = 0;
    if (sscanf(plan, "%63s %lu %d", name, &number, &failing_error) == 3) {
      failing_number = number;
      for (failing = 0; failing < kCount && strcmp(kCalls[failing], name) != 0;) ++failing;
    }
  }
  counters = reinterpret_cast<std::atomic<std::uint64_t>*>(memory);
}

/// Counts the call; true, with errno, for the one that fails.
bool fails(std::size_t call) {
  if (counters == nullptr) return false;
  const bool chosen = counters[call].fetch_add(1) + 1 == failing_number && call == failing;
  if (chosen) errno = failing_error;
  return chosen;
}

}  // namespace

extern "C" {

void* __libc_malloc(size_t size);
void* malloc(size_t size) { return fails(place("malloc")) ? nullptr : __libc_malloc(size); }

#define REPLACED(Type, name, failure, parameters, arguments)                                \
  Type name parameters {                                                                    \
    static const auto real = reinterpret_cast<Type(*) parameters>(dlsym(RTLD_NEXT, #name)); \
    return fails(place(#name)) ? failure : real arguments;                                  \
  }
// clang-format off
REPLACED(pid_t, fork, -1, (), ())
REPLACED(void*, mmap, MAP_FAILED, (void* at, size_t size, int rights, int flags, int file, off_t offset), (at, size, rights, flags, file, offset))
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
  if (!fails(place("write"))) return syscall(SYS_write, file, data, size);
  return failing_error != 0 || size < 2 ? -1 : syscall(SYS_write, file, data, size / 2);
}

FILE* fopen(const char* path, const char* mode) {
  static const auto real = reinterpret_cast<FILE* (*)(const char*, const char*)>(dlsym(RTLD_NEXT, "fopen"));
  return fails(place("fopen")) ? nullptr : real(path, mode);
}
FILE* fopen64(const char* path, const char* mode) { return fopen(path, mode); }

int open(const char* path, int flags, ...) {
  if (fails(place("open"))) return -1;
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);  // garbage that is not used, without O_CREAT
  va_end(more);
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

}  // extern "C"
