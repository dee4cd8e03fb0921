// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace hotpath {

/// The words as execv() and its like take them, which must not outlive `words`.
std::vector<char*> argument_list(std::vector<std::string>& words);

/// How another program ended, as waitpid() gives it, and what it wrote to its standard error.
struct ProgramEnd {
  int status = 0;
  std::string errors;
};

/// Runs a program (found along PATH) with its arguments to its end. It inherits our other streams; with
/// `silent`, its standard output is discarded. A stopped program gets SIGCONT, and the program is killed when
/// this process ends. Throws RunError when it cannot be started.
ProgramEnd run_program(std::vector<std::string> words, bool silent = false);

/// Goes on in a child, which is killed with this process. This process only waits: it ends with the child's
/// exit code, or returns the child's status, as waitpid() gives it, where a signal ended it; the child gets
/// nothing. Throws RunError when there can be no child.
std::optional<int> continue_in_child();

/// waitpid(), which no signal interrupts.
pid_t await_process(pid_t id, int* status, int flags = 0);

/// The path of the running program.
std::string own_program();

/// `ended in order`, `ended with exit code 3`, or `was ended by a signal (Killed)`, of a status as waitpid()
/// gives it.
std::string how_it_ended(int status);

/// Whether the process ended by itself with this exit code.
bool exited_with(int status, int code);

}  // namespace hotpath
