// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

#include "commands/command.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/utf8.hpp"
#include "program/child_process.hpp"
#include "program/shown_text.hpp"

namespace {

constexpr const char* kOutOfMemory =
    "hotpath: out of memory; raise the limit (ulimit -v, cgroup); a run marked complete in run.json is "
    "whole\n";

std::atomic<bool> out_of_memory = false;

/// An allocation may fail before main() begins, outside its handlers, or in a noexcept function of
/// the standard library, which terminates without an active exception
/// (std::filesystem::directory_iterator).
[[gnu::constructor(101)]] void report_out_of_memory() {
  std::set_new_handler([] {
    out_of_memory = true;
    throw std::bad_alloc();
  });
  std::set_terminate([] {
    try {
      const std::exception_ptr active = std::current_exception();
      if (active) std::rethrow_exception(active);
      if (out_of_memory) throw std::bad_alloc();
    } catch (const std::bad_alloc&) {
      std::fputs(kOutOfMemory, stderr);
      _exit(1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "hotpath: internal error: %s\n", hotpath::printable(error.what()).c_str());
    } catch (...) {
      std::fputs("hotpath: internal error: unknown exception\n", stderr);
    }
    std::abort();
  });
}

int exit_code(const std::exception& error) {
  if (dynamic_cast<const hotpath::program::ContractBroken*>(&error) != nullptr) return 3;
  const bool wrong_use = dynamic_cast<const hotpath::program::UsageError*>(&error) != nullptr ||
                         dynamic_cast<const hotpath::InputError*>(&error) != nullptr ||
                         dynamic_cast<const hotpath::AnalysisError*>(&error) != nullptr;
  return wrong_use ? 2 : 1;
}

/// The stack limit is also the default stack size of threads; a library call that overflows it
/// crashes without a message.
bool stack_suffices() {
  constexpr rlim_t kLeast_KiB = 256;
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kLeast_KiB << 10) return true;
  std::fprintf(stderr, "hotpath: the stack is limited to %lu KiB; allow at least %lu with `ulimit -s`\n",
               limit.rlim_cur >> 10, kLeast_KiB);
  return false;
}

/// The next opened file would get the number of a closed standard stream, and a result file would
/// receive our table or messages.
void occupy_standard_streams() {
  int opened = 0;
  do {
    opened = open("/dev/null", O_RDWR);
  } while (opened >= 0 && opened <= STDERR_FILENO);
  if (opened >= 0) close(opened);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace hotpath;
  occupy_standard_streams();
  if (!stack_suffices()) return 1;
  // A closed pipe or an exceeded file-size limit must fail the write, not kill the process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGCHLD, SIG_DFL);  // else the ends of child processes are lost
  program::restrict_new_files();

  const hotpath::program::PrintableStreams printable_streams;
  CLI::App app(
      "Measure, simulate and bound the age of the data along a robot's node graph under ROS executors.",
      "hotpath");
  app.footer(
      "First comparison:      hotpath graph --new robot.yaml && hotpath simulate robot.yaml\n"
      "Options of a command:  hotpath simulate --help");
  app.formatter(commands::help_formatter());
  app.set_help_all_flag("--help-all", "Print help with all options and exit");
  app.set_version_flag("--version", HOTPATH_VERSION);
  app.failure_message(commands::wrong_use);
  app.require_subcommand(1);
  commands::add_commands(app);
  try {
    std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
    std::ranges::reverse(words);  // as CLI11 wants them
    app.parse(words);
    std::cout << std::flush;
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      throw program::RunError("standard output could not be written; files are not affected");
    }
    return program::interrupted() != 0 ? 128 + program::interrupted() : 0;
  } catch (const CLI::RuntimeError& verdict) {  // without a message
    return verdict.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::bad_alloc&) {
    std::fputs(kOutOfMemory, stderr);
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hotpath: %s\n", printable(error.what(), commands::kLongestMessage).c_str());
    return exit_code(error);
  }
}
