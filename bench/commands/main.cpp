// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "commands/commands.hpp"
#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/input_error.hpp"
#include "hotpath/core/utf8.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/shown_text.hpp"

namespace {

constexpr std::size_t kLongestMessage = 4000;  // bytes; what is wrong may be a name of any length
constexpr const char* kMemoryEnded =
    "hotpath: memory ended; give it more (ulimit -v, cgroup); what run.json calls complete is whole\n";

std::atomic<bool> memory_ended = false;

/// Memory may be missing before main() begins, before its last handler, and in a function of the standard
/// library that is noexcept, which leaves no exception to ask (std::filesystem::directory_iterator).
[[gnu::constructor(101)]] void say_when_memory_is_missing() {
  std::set_new_handler([] {
    memory_ended = true;
    throw std::bad_alloc();
  });
  std::set_terminate([] {
    try {
      const std::exception_ptr active = std::current_exception();
      if (active) std::rethrow_exception(active);
      if (memory_ended) throw std::bad_alloc();
    } catch (const std::bad_alloc&) {
      std::fputs(kMemoryEnded, stderr);
      _exit(1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "hotpath: internal error: %s\n", hotpath::printable(error.what()).c_str());
    } catch (...) {
      std::fputs("hotpath: internal error: an exception of no known type\n", stderr);
    }
    std::abort();
  });
}

/// Whether the user can mend it.
bool is_wrong_use(const std::exception& error) {
  return dynamic_cast<const hotpath::UsageError*>(&error) != nullptr ||
         dynamic_cast<const hotpath::InputError*>(&error) != nullptr ||
         dynamic_cast<const hotpath::AnalysisError*>(&error) != nullptr;
}

/// Threads have stacks of this size by default; a call of a library that finds less ends without a word.
bool stack_suffices() {
  constexpr rlim_t kLeast_KiB = 256;
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kLeast_KiB << 10) return true;
  std::fprintf(stderr, "hotpath: the stack is limited to %lu KiB; allow at least %lu with `ulimit -s`\n",
               limit.rlim_cur >> 10, kLeast_KiB);
  return false;
}

/// A standard stream that the caller closed would give its number to the next file opened, and our table or
/// messages would end up in a result.
void occupy_standard_streams() {
  int opened = 0;
  do {
    opened = open("/dev/null", O_RDWR);
  } while (opened >= 0 && opened <= STDERR_FILENO);
  if (opened >= 0) close(opened);
}

std::string wrong_use(const CLI::App* app, const CLI::Error& error) {
  std::string command = app->get_name(), what = error.what();
  for (const CLI::App* sub : app->get_subcommands()) {
    command += " " + sub->get_name();
    app = sub;
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError) &&
      app->get_require_subcommand_min() > 0) {
    const std::vector<std::string> words = app->remaining();
    what = words.empty() ? "a command is missing; there are"
                         : "there is no command `" + words.front() + "`; there are";
    const char* separator = " ";
    for (const CLI::App* sub : app->get_subcommands({})) {
      what += std::exchange(separator, ", ") + sub->get_name();
    }
  }
  return "hotpath: " + hotpath::printable(what, kLongestMessage) + "; see `" + command + " --help`\n";
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_streams();
  if (!stack_suffices()) return 1;
  // A reader that goes away, or a limit on the size of files, is an error of the write that meets it.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  umask(umask(0) | 077);  // results and shared memory are the user's alone

  const hotpath::PrintableStreams printable_streams;
  CLI::App app("How long does data take along the hot path of a robot's node graph, under which executor?",
               "hotpath");
  app.footer(
      "A first look, half a minute:  hotpath compare --quick\n"
      "All options of a command:     hotpath compare --help");
  app.set_version_flag("--version", HOTPATH_VERSION);
  app.failure_message(wrong_use);
  app.require_subcommand(1);
  using namespace hotpath;
  const std::initializer_list<void (*)(CLI::App&)> commands = {
      add_run_command,     add_compare_command,         add_simulate_command,
      add_sweep_command,   add_capacity_command,        add_timeline_command,
      add_replay_command,  add_validate_command,        add_list_command,
      add_graph_command,   add_analyze_command,         add_experiment_command,
      add_machine_command, add_bench_command,           add_summarize_command,
      add_report_command,  add_compare_results_command, add_advise_command,
      add_import_command,  add_export_command,          add_recover_command,
      add_check_command};
  for (const auto add : commands) add(app);
  try {
    app.parse(argc, argv);
    std::cout << std::flush;
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
      throw RunError("standard output could not be written; files are not affected");
    }
    return interrupted() != 0 ? 128 + interrupted() : 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::bad_alloc&) {
    std::fputs(kMemoryEnded, stderr);
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hotpath: %s\n", printable(error.what(), kLongestMessage).c_str());
    return is_wrong_use(error) ? 2 : 1;
  }
}
