// SPDX-License-Identifier: Apache-2.0
#include "microbench/bench_suite.hpp"

#include <filesystem>
#include <fstream>
#include <iostream>

#include "hotpath/live/clock.hpp"
#include "machine/machine.hpp"
#include "machine/shared_memory_watch.hpp"
#include "microbench/bench_values.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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
    create_folder(folder_ / "raw");
    if (fs::exists(folder_ / "bench.json")) {
      throw UsageError("the output folder " + folder_.string() +
                       " holds a run already; name another with --output, or remove it");
    }
  }

  void run() {
    catch_interrupts();
    for (const std::string& sentence : warnings(machine_)) std::cerr << "note: " << sentence << "\n";
    const auto order = interleaved(options_.repetitions, paths_.size(), options_.seed);
    {
      Progress progress(order.size(), kExpected);
      for (const auto& [repetition, program] : order) {
        if (interrupted() != 0) break;
        progress.begin(concat(options_.programs[program], ", repetition ", repetition));
        measure(program, repetition, progress);
      }
    }
    if (values_.values.empty() && !failures_.empty()) throw RunError(failures_.front());
    write();
    if (values_.values.empty()) {
      std::cerr << "note: Interrupted before anything was measured.\n";
      return;
    }
    draw_figure("bench", folder_);
    std::cout << "Results: " << folder_.string() << "\n" << std::flush;
    for (const std::string& failure : failures_) std::cerr << "note: " << failure << "\n";
    if (!failures_.empty() && interrupted() == 0) {
      throw RunError(concat(failures_.size(), " measurements failed; the rest is in ", folder_.string()));
    }
  }

 private:
  /// What a program takes, roughly: for the estimate of the time left.
  static constexpr Duration kExpected = std::chrono::seconds(40);

  void measure(std::size_t program, std::uint32_t repetition, Progress& progress) {
    const std::string stem = concat(options_.programs[program], "-", repetition);
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
      const auto errors_before = static_cast<std::ptrdiff_t>(values_.errors.size());
      add_google_benchmark_output(values_, json::parse(in));
      failures_.insert(failures_.end(), values_.errors.begin() + errors_before, values_.errors.end());
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
    ChildProcess child({.words = words, .log = log, .own_group = true});
    const Time begin = now();
    for (;;) {
      if (const auto status = child.wait(std::chrono::milliseconds(50))) {
        return exited_with(*status, 0) ? ""
                                       : "failed: it " + how_it_ended(*status) + "; see its .txt in raw/";
      }
      const Duration elapsed = now() - begin;
      if (interrupted() != 0 || elapsed > from_ms(options_.time_out_s * 1000)) break;
      progress.update(elapsed, kExpected);
    }
    // What it and those it started leave of Fast DDS's files they can no longer remove themselves.
    SharedMemoryWatch files;
    files.note_group(child.id());
    child.kill_group();
    files.remove_orphans();
    return "did not end in time; see --time-out";
  }

  void write() const {
    json content = values_;
    content.update({{"complete", failures_.empty() && interrupted() == 0},
                    {"version", HOTPATH_VERSION},
                    {"date", time_stamp("%Y-%m-%dT%H:%M:%S%z")},
                    {"programs", options_.programs},
                    {"repetitions", options_.repetitions},
                    {"quick", options_.quick},
                    {"seed", options_.seed},
                    {"machine", machine_},
                    {"failures", failures_}});
    write_whole_file(folder_ / "bench.json", content);
  }

  SuiteOptions options_;
  std::vector<fs::path> paths_;
  fs::path folder_;
  const Machine machine_ = read_machine();
  BenchValues values_;
  std::vector<std::string> failures_;
};

}  // namespace

std::vector<std::string> bench_programs() {
  return {"scheduler", "simulator", "executor", "transport", "hot_path"};
}

void run_suite(const SuiteOptions& options) { Suite(options).run(); }

}  // namespace hotpath
