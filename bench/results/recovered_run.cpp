// SPDX-License-Identifier: Apache-2.0
#include "results/stored_summary.hpp"

#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "hotpath/core/input_file.hpp"
#include "program/errors.hpp"
#include "program/whole_file.hpp"
#include "results/run_folder.hpp"

namespace hotpath::results {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// The beginnings `EXECUTOR,REPETITION,` of rows.
using Prefixes = std::set<std::string>;

Prefixes measured_repetitions(const StoredRun& run) {
  Prefixes prefixes;
  for (const RepetitionRecord& r : run.record().runs) {
    if (r.failure.empty()) prefixes.insert(r.executor + "," + std::to_string(r.repetition) + ",");
  }
  return prefixes;
}

/// Copies the header and the rows with these prefixes. Ignores an incomplete last line.
void copy_rows(const fs::path& from, const Prefixes& kept, std::ostream& out) {
  std::ifstream in = open_input(from, "remove the file to recover the others");
  std::string line;
  for (bool header = true; std::getline(in, line) && !in.eof(); header = false) {
    const std::size_t end = line.find(',', line.find(',') + 1);
    if (header || (end != std::string::npos && kept.contains(line.substr(0, end + 1)))) out << line << '\n';
  }
  if (!in.eof()) out.setstate(std::ios::badbit);
}

/// Removes temporary files of an interrupted replacement.
void remove_unfinished(const fs::path& folder) {
  std::vector<fs::path> unfinished;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    for (const char* file : {".run.json.", ".summary.json.", ".jobs.csv.", ".chains.csv."}) {
      if (name.starts_with(file) && name.ends_with(".part")) unfinished.push_back(entry.path());
    }
  }
  for (const fs::path& file : unfinished) fs::remove(file);
}

}  // namespace

Summary recover_run(const fs::path& folder) {
  StoredRun killed(folder, "doctor --recover");
  // A run records its end last: if killed just before, it has all files but no recorded end.
  const RunRecord& before = killed.record();
  const bool ended = before.complete || before.partial || !before.failures.empty();
  const bool grows = fs::exists(folder / "jobs.csv.part") || fs::exists(folder / "chains.csv.part");
  if (ended && !grows && fs::exists(folder / "summary.json")) {
    killed.fail("nothing to recover: its results are complete; `hotpath report --summary` reads them");
  }
  const int lock = RunFolder::lock(folder);
  if (lock < 0 && fs::exists(folder / "jobs.csv.part")) {
    killed.fail("the run is still running; end it with Ctrl-C");
  }
  const Prefixes kept = measured_repetitions(killed);
  if (kept.empty()) killed.fail("the run was killed before its first repetition ended; run it again");

  for (const char* name : {"jobs.csv", "chains.csv"}) {
    const fs::path whole = folder / name, grown = whole.string() + ".part";
    if (!fs::exists(grown)) continue;  // killed after the file was renamed
    program::write_whole_file(whole, [&](std::ostream& out) { copy_rows(grown, kept, out); });
    fs::remove(grown);
  }
  if (lock >= 0) close(lock);
  remove_unfinished(folder);

  const StoredRun run(folder, "doctor --recover");
  Summary summary = summarize(run, run.summary_options());
  program::write_whole_file(folder / "summary.json", json(summary));
  RunRecord record = run.record();
  record.partial = true;
  record.warnings.emplace_back("The run was killed: its finished repetitions were recovered.");
  program::write_whole_file(folder / "run.json", json(record));
  return summary;
}

}  // namespace hotpath::results
