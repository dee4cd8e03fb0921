// SPDX-License-Identifier: Apache-2.0
#include "program/child_process.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <tuple>
#include <utility>

#include "program/errors.hpp"

namespace hotpath::program {

std::vector<char*> argument_list(std::vector<std::string>& words) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  return arguments;
}

namespace {

RunError not_started(const std::string& program, int cause) {
  return RunError{"`" + program + "` could not be started (" + std::strerror(cause) + "); is it installed?"};
}

/// The new process is killed when the thread ends that waits for it.
void die_with(pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
}

/// fork() of a process that dies with this one. Throws RunError.
pid_t fork_dependent() {
  const pid_t parent = getpid(), child = fork();
  if (child < 0) throw RunError(std::string("no process could be created: ") + std::strerror(errno));
  if (child == 0) die_with(parent);
  return child;
}

}  // namespace

pid_t start_program(std::vector<std::string> words, const std::function<void()>& prepare,
                    char* const* environment) {
  const std::vector<char*> arguments = argument_list(words);
  int failure[2];
  if (pipe2(failure, O_CLOEXEC) != 0) throw not_started(words.front(), errno);
  const pid_t id = fork();
  if (id == 0) {
    prepare();
    execvpe(arguments.front(), arguments.data(), environment);
    const int cause = errno;
    std::ignore = write(failure[1], &cause, sizeof cause);
    _exit(127);
  }
  int cause = id < 0 ? errno : 0;
  close(failure[1]);
  ssize_t bytes = 0;  // end of file, once exec() has closed the pipe
  do {
    bytes = id > 0 ? read(failure[0], &cause, sizeof cause) : 1;
  } while (bytes < 0 && errno == EINTR);
  close(failure[0]);
  if (bytes == 0) return id;
  int status = 0;
  if (id > 0) await_process(id, &status);
  throw not_started(words.front(), cause);
}

ProgramEnd run_program(std::vector<std::string> words, bool silent) {
  const std::unique_ptr<FILE, int (*)(FILE*)> errors(std::tmpfile(), std::fclose);
  if (!errors) throw RunError(std::string("no temporary file: ") + std::strerror(errno));
  const int standard_error = fileno(errors.get());
  const pid_t parent = getpid();
  const pid_t id = start_program(
      std::move(words),
      [&] {
        die_with(parent);
        dup2(standard_error, STDERR_FILENO);
        if (silent) dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
      },
      environ);
  ProgramEnd end;
  // Continue a program that was stopped alone, so that we do not wait forever. Ctrl-Z stops us as
  // well.
  while (await_process(id, &end.status, WUNTRACED) == id && WIFSTOPPED(end.status)) kill(id, SIGCONT);
  std::rewind(errors.get());
  std::string text;
  for (int c = std::getc(errors.get()); c != EOF; c = std::getc(errors.get())) text += static_cast<char>(c);
  text.resize(text.find_last_not_of('\n') + 1);
  end.message = text.substr(text.rfind('\n') + 1);
  return end;
}

void run_hotpath(std::vector<std::string> words, const std::string& program) {
  words.insert(words.begin(), program.empty() ? own_program() : program);
  static const int once = setenv("HOTPATH_FIGURES", "none", 1);  // threads read the environment
  (void)once;
  auto [status, message] = run_program(std::move(words), true);
  if (exited_with(status, 0)) return;
  constexpr std::string_view kOurName = "hotpath: ";
  if (message.starts_with(kOurName)) message.erase(0, kOurName.size());
  if (message.empty()) message = how_it_ended(status);
  if (exited_with(status, 2)) throw UsageError(message);
  throw RunError(message);
}

void become(std::vector<std::string> words) {
  std::cout << std::flush;
  std::fflush(stdout);
  execv(words.front().c_str(), argument_list(words).data());
  throw RunError(words.front() + " could not be started (" + std::strerror(errno) + ")");
}

std::optional<int> continue_in_child() {
  const pid_t child = fork_dependent();
  if (child == 0) return std::nullopt;
  int status = 0;
  await_process(child, &status);
  if (WIFEXITED(status)) _exit(WEXITSTATUS(status));
  return status;
}

pid_t await_process(pid_t id, int* status, int flags) {
  pid_t ended = 0;
  do {
    ended = waitpid(id, status, flags);
  } while (ended < 0 && errno == EINTR);
  return ended;
}

std::string own_program() { return std::filesystem::read_symlink("/proc/self/exe"); }

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return std::string("was ended by a signal (") + strsignal(WTERMSIG(status)) + ")";
  return WEXITSTATUS(status) == 0 ? "ended in order"
                                  : "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

bool exited_with(int status, int code) { return WIFEXITED(status) && WEXITSTATUS(status) == code; }

ForkedTask::ForkedTask(const std::function<void()>& task) : error_(memfd_create("error", MFD_CLOEXEC)) {
  try {
    if (error_ < 0) throw RunError(std::string("no process could be created: ") + std::strerror(errno));
    id_ = fork_dependent();
  } catch (const RunError&) {
    close(error_);
    throw;
  }
  if (id_ > 0) return;
  setpgid(0, 0);  // the terminal's signals are for the parent
  std::string error;
  try {
    task();
  } catch (const std::exception& e) {
    error = e.what();
  }
  std::ignore = write(error_, error.data(), error.size());
  _exit(0);  // without destructors: what they end belongs to the parent
}

ForkedTask::~ForkedTask() {
  if (!result_) {
    kill(-id_, SIGKILL);
    kill(id_, SIGKILL);  // before it has a group of its own
    await_process(id_, nullptr);
  }
  close(error_);
}

const std::optional<std::string>& ForkedTask::end(bool wait) {
  int status = 0;
  if (result_) return result_;
  const pid_t ended = await_process(id_, &status, wait ? 0 : WNOHANG);
  if (ended == 0) return result_;
  std::array<char, 4096> text;
  const ssize_t length = pread(error_, text.data(), text.size(), 0);
  result_.emplace(text.data(), static_cast<std::size_t>(std::max<ssize_t>(length, 0)));
  if (result_->empty() && ended < 0)  // SIGCHLD is ignored
    result_ = "the process has ended, but how is unknown";
  if (result_->empty() && !exited_with(status, 0)) result_ = "the process " + how_it_ended(status);
  return result_;
}

}  // namespace hotpath::program
