// SPDX-License-Identifier: Apache-2.0
// Other programs as child processes: their streams, their ends, and their groups.
#include "program/child_process.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <csignal>
#include <fstream>

#include "program/errors.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

std::vector<std::string> shell(const std::string& script) { return {"sh", "-c", script}; }

TEST(ChildProcess, TellsItsErrorsAndItsExitCode) {
  ChildProcess child({.words = shell("echo wrong >&2; exit 3"), .capture_errors = true});
  EXPECT_EQ(child.errors(), "wrong\n");
  const int status = child.wait();
  EXPECT_TRUE(exited_with(status, 3));
  EXPECT_EQ(how_it_ended(status), "ended with exit code 3");
  EXPECT_EQ(child.wait(), status);
}

TEST(ChildProcess, ReadsItsInputAndWritesItsLog) {
  const std::string log = testing::TempDir() + "child_process.txt";
  ChildProcess child({.words = {"cat"}, .input = std::string(300'000, 'x') + "end", .log = log});
  EXPECT_TRUE(exited_with(child.wait(), 0));
  std::ifstream in(log);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(text.size(), 300'003U);
  EXPECT_TRUE(text.ends_with("xend"));
}

TEST(ChildProcess, EndsWithAllThatItStarted) {
  ChildProcess child({.words = shell("tail -f /dev/null & tail -f /dev/null"), .own_group = true});
  EXPECT_EQ(child.wait(50ms), std::nullopt);
  child.kill_group();
  EXPECT_EQ(how_it_ended(child.wait()), "was ended by a signal (Killed)");
  EXPECT_EQ(kill(-child.id(), 0), -1);
}

TEST(ChildProcess, RefusesAProgramThatIsNotThere) {
  try {
    ChildProcess child({.words = {"no-such-program"}});
    FAIL();
  } catch (const RunError& error) {
    EXPECT_THAT(error.what(), HasSubstr("`no-such-program` could not be started"));
  }
}

}  // namespace
}  // namespace hotpath
