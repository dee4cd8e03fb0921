// SPDX-License-Identifier: Apache-2.0
#include "program/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "program/errors.hpp"

namespace hotpath {

std::vector<char*> argument_list(std::vector<std::string>& words) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  return arguments;
}

ProgramEnd run_program(std::vector<std::string> words, bool silent) {
  const std::unique_ptr<FILE, int (*)(FILE*)> errors(std::tmpfile(), std::fclose);
  if (!errors) throw RunError(std::string("no temporary file: ") + std::strerror(errno));
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, fileno(errors.get()), STDERR_FILENO);
  if (silent) posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t id = -1;
  const int refused =
      posix_spawnp(&id, words.front().c_str(), &files, nullptr, argument_list(words).data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (refused != 0) {
    throw RunError("`" + words.front() + "` could not be started (" + std::strerror(refused) +
                   "); is it installed?");
  }
  ProgramEnd end;
  // Whoever stops it alone must not let us wait for ever. Ctrl-Z stops us as well, until both go on.
  while (await_process(id, &end.status, WUNTRACED) == id && WIFSTOPPED(end.status)) kill(id, SIGCONT);
  std::rewind(errors.get());
  for (int c = std::getc(errors.get()); c != EOF; c = std::getc(errors.get())) {
    end.errors.push_back(static_cast<char>(c));
  }
  return end;
}

std::optional<int> continue_in_child() {
  const pid_t parent = getpid(), child = fork();
  if (child < 0) throw RunError(std::string("no process could be made: ") + std::strerror(errno));
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

}  // namespace hotpath
