// SPDX-License-Identifier: Apache-2.0
#include "program/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>

#include "program/errors.hpp"

extern char** environ;

namespace hotpath {

namespace {

/// Both ends of a pipe, closed at the end of their life unless released.
struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw RunError(std::string("no pipe: ") + std::strerror(errno));
  }
  ~Pipe() {
    for (int i = 0; i < 2; ++i) close_end(i);
  }
  void close_end(int i) {
    if (ends[i] >= 0) close(std::exchange(ends[i], -1));
  }
  std::array<int, 2> ends{-1, -1};  ///< To read from, and to write to.
};

void write_all(int descriptor, const std::string& text) {
  for (std::size_t from = 0; from < text.size();) {
    const ssize_t n = write(descriptor, text.data() + from, text.size() - from);
    // A reader that has gone says why when it ends.
    if (n < 0 && errno != EINTR) return;
    if (n > 0) from += static_cast<std::size_t>(n);
  }
}

}  // namespace

ChildProcess::ChildProcess(const ChildOptions& options) : own_group_(options.own_group) {
  std::optional<Pipe> input, errors;
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  if (options.input) {
    posix_spawn_file_actions_adddup2(&files, input.emplace().ends[0], STDIN_FILENO);
  }
  if (!options.log.empty()) {
    constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, options.log.c_str(), kNew, 0644);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  }
  if (options.capture_errors) {
    posix_spawn_file_actions_adddup2(&files, errors.emplace().ends[1], STDERR_FILENO);
  }
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (own_group_) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<std::string> words = options.words;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const int refused =
      posix_spawnp(&id_, words.front().c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (refused != 0) {
    id_ = -1;
    throw RunError("`" + words.front() + "` could not be started (" + std::strerror(refused) +
                   "); is it installed?");
  }
  if (input) {
    input->close_end(0);
    write_all(input->ends[1], *options.input);
  }
  if (errors) errors_ = std::exchange(errors->ends[0], -1);
}

ChildProcess::~ChildProcess() {
  if (errors_ >= 0) close(errors_);
  if (!status_) kill_group();
}

std::string ChildProcess::errors() {
  std::string text;
  std::array<char, 4096> block;
  for (;;) {
    const ssize_t n = read(errors_, block.data(), block.size());
    if (n > 0) {
      text.append(block.data(), static_cast<std::size_t>(n));
    } else if (n == 0 || errno != EINTR) {
      return text;
    }
  }
}

int ChildProcess::wait() {
  int status = 0;
  while (!status_) {
    if (waitpid(id_, &status, 0) == id_) status_ = status;
  }
  return *status_;
}

std::optional<int> ChildProcess::wait(Duration time_out) {
  const Time limit = std::chrono::steady_clock::now() + time_out;
  for (int status = 0; !status_;) {
    if (waitpid(id_, &status, WNOHANG) == id_) {
      status_ = status;
    } else if (std::chrono::steady_clock::now() >= limit) {
      break;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  return status_;
}

void ChildProcess::kill_group() {
  kill(own_group_ ? -id_ : id_, SIGKILL);
  wait();
  const Time limit = std::chrono::steady_clock::now() + std::chrono::seconds(2);
  while (own_group_ && kill(-id_, 0) == 0 && std::chrono::steady_clock::now() < limit) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return std::string("was ended by a signal (") + strsignal(WTERMSIG(status)) + ")";
  return WEXITSTATUS(status) == 0 ? "ended in order"
                                  : "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

bool exited_with(int status, int code) { return WIFEXITED(status) && WEXITSTATUS(status) == code; }

}  // namespace hotpath
