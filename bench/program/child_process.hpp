// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hotpath::program {

/// The file mode creation mask with which this process was started, for programs that it starts.
inline mode_t inherited_umask = 022;

/// From now on only the user may access new files and shared memory.
inline void restrict_new_files() {
  inherited_umask = umask(077);
  umask(inherited_umask | 077);
}

/// The words as an argument list for execv(); it must not outlive `words`.
std::vector<char*> argument_list(std::vector<std::string>& words);

/// Starts a program (found along PATH) with these arguments and this environment. The child process
/// first calls `prepare`, which may only call functions that are safe although other threads may
/// have held locks during fork(). Returns its id, for await_process(). Throws RunError when the
/// program cannot be started.
pid_t start_program(std::vector<std::string> words, const std::function<void()>& prepare,
                    char* const* environment);

/// The result of another program.
struct ProgramEnd {
  int status = 0;       ///< As from waitpid().
  std::string message;  ///< The last line of its standard error.
};

/// Runs a program (found along PATH) with its arguments and waits for its end. It inherits standard
/// input and output; `silent` discards its standard output. A stopped program gets SIGCONT. The
/// program is killed when this process ends. Throws RunError when it cannot be started.
ProgramEnd run_program(std::vector<std::string> words, bool silent = false);

/// Runs this program, or another build of it, with these words in its own process, silently and without
/// figures. On failure, throws its last line of output: UsageError for wrong use (exit code 2), else
/// RunError.
void run_hotpath(std::vector<std::string> words, const std::string& program = "");

/// Continues as the program of this path, after writing all output. Throws RunError when it cannot be
/// started.
[[noreturn]] void become(std::vector<std::string> words);

/// Forks; the child continues with std::nullopt and is killed with this process. The parent only
/// waits: it exits with the child's exit code, or returns the child's status, as from waitpid(), if
/// a signal ended it. Throws RunError when fork() fails.
std::optional<int> continue_in_child();

/// waitpid(), repeated after interruption by a signal.
pid_t await_process(pid_t id, int* status, int flags = 0);

/// The path of the running program.
std::string own_program();

/// Describes a status as from waitpid(): `ended in order`, `ended with exit code 3`, or `was ended
/// by a signal (Killed)`.
std::string how_it_ended(int status);

/// Whether the process exited with this code, not by a signal.
bool exited_with(int status, int code);

/// A task in a child process, which has the memory of this process at the time of the fork. It is killed
/// when this process ends. For processes with one thread.
class ForkedTask {
 public:
  /// Throws RunError if no process could be created.
  explicit ForkedTask(const std::function<void()>& task);
  ForkedTask(const ForkedTask&) = delete;
  ForkedTask& operator=(const ForkedTask&) = delete;
  /// Kills it, with the programs that it started, if it still runs.
  ~ForkedTask();

  /// Why it failed, or an empty text, once it has ended. Can be asked again.
  [[nodiscard]] const std::optional<std::string>& result() { return end(false); }
  /// The same; waits for the end.
  [[nodiscard]] const std::string& wait() { return *end(true); }

 private:
  const std::optional<std::string>& end(bool wait);

  int error_ = -1;  // file in memory
  pid_t id_ = -1;
  std::optional<std::string> result_;
};

}  // namespace hotpath::program
