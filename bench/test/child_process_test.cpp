// SPDX-License-Identifier: Apache-2.0
// Runs other programs as child processes and reports their errors and ends.
#include "program/child_process.hpp"

#include <gmock/gmock.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "program/errors.hpp"

namespace hotpath::child_process_test {

std::vector<std::string> shell(const std::string& script) { return {"sh", "-c", script}; }

TEST(RunProgram, TellsItsErrorsAndItsExitCode) {
  const program::ProgramEnd end = program::run_program(shell("echo first >&2; echo wrong >&2; exit 3"));
  EXPECT_EQ(end.message, "wrong");
  EXPECT_TRUE(program::exited_with(end.status, 3));
  EXPECT_EQ(program::how_it_ended(end.status), "ended with exit code 3");
}

TEST(RunProgram, LetsAProgramGoOnThatWasStopped) {
  EXPECT_TRUE(program::exited_with(program::run_program(shell("kill -STOP $$; exit 3")).status, 3));
}

TEST(RunProgram, KillsTheProgramWithThisProcess) {
  ASSERT_EQ(prctl(PR_SET_CHILD_SUBREAPER, 1), 0);  // adopts the program when its parent is gone
  int channel[2];
  ASSERT_EQ(pipe(channel), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    dup2(channel[1], STDOUT_FILENO);
    program::run_program(shell("echo $$; exec sleep 20"));
    _exit(0);
  }
  char number[16] = {};
  ASSERT_GT(read(channel[0], number, sizeof number - 1), 0);
  kill(parent, SIGKILL);
  int status = 0;
  program::await_process(parent, &status);
  program::await_process(std::stoi(number), &status);
  EXPECT_EQ(program::how_it_ended(status), "was ended by a signal (Killed)");
}

TEST(ForkedTask, WorksOnACopyOfTheMemory) {
  int value = 1;
  program::ForkedTask task([&] { value = 2; });
  EXPECT_EQ(task.wait(), "");
  EXPECT_EQ(value, 1);
  ASSERT_TRUE(task.result().has_value());
}

TEST(ForkedTask, TellsWhyItFailed) {
  program::ForkedTask failing([] { throw program::RunError("no room"); });
  EXPECT_EQ(failing.wait(), "no room");
  program::ForkedTask killed([] { std::raise(SIGKILL); });
  EXPECT_EQ(killed.wait(), "the process was ended by a signal (Killed)");
}

TEST(ForkedTask, ReportsAnEndThatTheSystemForgot) {
  std::signal(SIGCHLD, SIG_IGN);
  program::ForkedTask ended([] {}), failing([] { throw program::RunError("no room"); });
  EXPECT_EQ(ended.wait(), "the process has ended, but how is unknown");
  EXPECT_EQ(failing.wait(), "no room");
  std::signal(SIGCHLD, SIG_DFL);
}

TEST(ForkedTask, EndsWithItsProgramsWhenItIsForgotten) {
  int channel[2];
  ASSERT_EQ(pipe(channel), 0);
  char byte = 0;
  {
    const program::ForkedTask task([&] {
      close(channel[0]);
      dup2(channel[1], STDOUT_FILENO);
      (void)program::run_program(shell("echo; sleep 1000; true"));
    });
    close(channel[1]);
    ASSERT_EQ(read(channel[0], &byte, 1), 1) << "its program runs";
  }
  EXPECT_EQ(read(channel[0], &byte, 1), 0) << "no process holds the other end";
  close(channel[0]);
}

}  // namespace hotpath::child_process_test
