// SPDX-License-Identifier: Apache-2.0
#include "program/child_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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
        prctl(PR_SET_PDEATHSIG, SIGKILL);  // dies with the thread that waits for it
        if (getppid() != parent) _exit(1);
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
  const pid_t parent = getpid(), child = fork();
  if (child < 0) throw RunError(std::string("no process could be created: ") + std::strerror(errno));
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1);
    return std::nullopt;
  }
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

}  // namespace hotpath::program
