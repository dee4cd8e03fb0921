// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_suite.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "machine/machine.hpp"
#include "machine/shared_memory_watch.hpp"
#include "microbench/bench_values.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"

extern char** environ;

namespace hotpath {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Time now() { return std::chrono::steady_clock::now(); }

std::string time_stamp(const char* format) {
  const std::time_t t = std::time(nullptr);
  char text[64];
  std::strftime(text, sizeof(text), format, std::localtime(&t));
  return text;
}

/// The program's path: next to the command in a build tree, in lib/hotpath_bench when installed.
fs::path find_program(const std::string& name) {
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& folder : {here, here / "../lib/hotpath_bench"}) {
    if (fs::exists(folder / name)) return folder / name;
  }
  throw UsageError("the benchmark program " + name +
                   " was not built: install libbenchmark-dev (Google Benchmark) and build again");
}

class Suite {
 public:
  explicit Suite(const SuiteOptions& options) : options_(options) {
    if (options_.programs.empty()) options_.programs = bench_programs();
    if (options_.quick) options_.repetitions = 1;
    for (const std::string& name : options_.programs) paths_.push_back(find_program("bench_" + name));
    folder_ = options_.output.empty() ? "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-bench" : options_.output;
    std::error_code error;
    fs::create_directories(folder_ / "raw", error);
    if (error) {
      throw UsageError("the output folder " + folder_.string() + " cannot be created (" + error.message() +
                       "); name another with --output");
    }
    if (fs::exists(folder_ / "bench.json", error)) {
      throw UsageError("the output folder " + folder_.string() +
                       " holds a run already; name another with --output, or remove it");
    }
  }

  void run() {
    catch_interrupts();
    for (const std::string& sentence : warnings(machine_)) std::cerr << "note: " << sentence << "\n";
    const auto order = schedule();
    {
      Progress progress(kExpected * static_cast<std::int64_t>(order.size()));
      for (std::size_t i = 0; i < order.size() && interrupted() == 0; ++i) {
        const auto [repetition, program] = order[i];
        progress.begin("[" + std::to_string(i + 1) + "/" + std::to_string(order.size()) + "] " +
                           options_.programs[program] + ", repetition " + std::to_string(repetition),
                       kExpected * static_cast<std::int64_t>(i));
        measure(program, repetition, progress);
      }
    }
    if (figures_.values.empty() && !failures_.empty()) throw RunError(failures_.front());
    write();
    if (figures_.values.empty()) {
      std::cerr << "note: Interrupted before anything was measured.\n";
      return;
    }
    draw_figure("bench_report.py", folder_);
    std::cout << "Results: " << folder_.string() << "\n" << std::flush;
    for (const std::string& failure : failures_) std::cerr << "note: " << failure << "\n";
    if (!failures_.empty() && interrupted() == 0) {
      throw RunError(std::to_string(failures_.size()) + " measurements failed; the rest is in " +
                     folder_.string());
    }
  }

 private:
  /// What a program takes, roughly: for the estimate of the time left.
  static constexpr Duration kExpected = std::chrono::seconds(40);

  std::vector<std::pair<std::uint32_t, std::size_t>> schedule() const {
    std::vector<std::pair<std::uint32_t, std::size_t>> order;
    std::mt19937_64 random(options_.seed);
    for (std::uint32_t r = 0; r < options_.repetitions; ++r) {
      const std::size_t begin = order.size();
      for (std::size_t p = 0; p < paths_.size(); ++p) order.emplace_back(r, p);
      std::shuffle(order.begin() + static_cast<std::ptrdiff_t>(begin), order.end(), random);
    }
    return order;
  }

  void measure(std::size_t program, std::uint32_t repetition, Progress& progress) {
    const std::string stem = options_.programs[program] + "-" + std::to_string(repetition);
    const fs::path output = folder_ / "raw" / (stem + ".json");
    const std::string failure = execute(paths_[program], output, folder_ / "raw" / (stem + ".txt"), progress);
    progress.clear();
    if (interrupted() != 0) return;
    if (!failure.empty()) {
      failures_.push_back("bench_" + stem + " " + failure);
      return;
    }
    try {
      std::ifstream in(output);
      const std::size_t errors_before = figures_.errors.size();
      add_google_benchmark_output(figures_, json::parse(in));
      failures_.insert(failures_.end(), figures_.errors.begin() + static_cast<std::ptrdiff_t>(errors_before),
                       figures_.errors.end());
    } catch (const std::exception& error) {
      failures_.push_back(output.string() + ": " + error.what());
    }
  }

  /// Returns what went wrong; empty: nothing.
  std::string execute(const fs::path& program, const fs::path& output, const fs::path& log,
                      Progress& progress) const {
    std::vector<std::string> words = {program.string(), "--benchmark_out=" + output.string(),
                                      "--benchmark_out_format=json",
                                      "--benchmark_enable_random_interleaving=true"};
    if (options_.quick) words.push_back("--quick");
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);

    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    // A group of its own, so that the measuring processes it starts can be ended with it.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    pid_t pid = 0;
    const int refused = posix_spawn(&pid, program.c_str(), &files, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (refused != 0) return "could not be started";
    return watch(pid, progress);
  }

  std::string watch(pid_t pid, Progress& progress) const {
    const Time begin = now(), limit = begin + from_ms(options_.time_out_s * 1000);
    for (int status = 0;;) {
      if (waitpid(pid, &status, WNOHANG) == pid) return status == 0 ? "" : "failed; see its .txt in raw/";
      if (interrupted() != 0 || now() > limit) {
        end_group(pid);
        return "did not end in time; see --time-out";
      }
      progress.update(now() - begin, kExpected);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  /// Ends a program and all that it started, which can no longer remove Fast DDS's files itself.
  static void end_group(pid_t pid) {
    SharedMemoryWatch files;
    files.note_group(pid);
    kill(-pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    const Time limit = now() + std::chrono::seconds(2);
    while (kill(-pid, 0) == 0 && now() < limit) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    files.remove_orphans();
  }

  void write() const {
    json content = to_json(figures_);
    content["complete"] = failures_.empty() && interrupted() == 0;
    content["version"] = HOTPATH_VERSION;
    content["date"] = time_stamp("%Y-%m-%dT%H:%M:%S%z");
    content["programs"] = options_.programs;
    content["repetitions"] = options_.repetitions;
    content["quick"] = options_.quick;
    content["seed"] = options_.seed;
    content["machine"] = to_json(machine_);
    content["failures"] = failures_;
    const fs::path part = folder_ / "bench.json.part";
    std::ofstream out(part);
    out << content.dump(1) << "\n" << std::flush;
    if (!out) throw RunError("cannot write " + part.string());
    fs::rename(part, folder_ / "bench.json");
  }

  SuiteOptions options_;
  std::vector<fs::path> paths_;
  fs::path folder_;
  const Machine machine_ = read_machine();
  BenchFigures figures_;
  std::vector<std::string> failures_;
};

}  // namespace

std::vector<std::string> bench_programs() {
  return {"scheduler", "simulator", "executor", "transport", "hot_path"};
}

void run_suite(const SuiteOptions& options) { Suite(options).run(); }

}  // namespace hotpath
