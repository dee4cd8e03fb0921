// SPDX-License-Identifier: Apache-2.0
#include "results/recovered_run.hpp"

#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "hotpath/core/input_file.hpp"
#include "program/errors.hpp"
#include "program/whole_file.hpp"
#include "results/run_folder.hpp"
#include "results/stored_summary.hpp"

namespace hotpath {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

/// `EXECUTOR,REPETITION,`, as the rows of a repetition begin.
using Beginnings = std::set<std::string>;

Beginnings measured_repetitions(const StoredRun& run) {
  return run.check([&] {
    Beginnings found;
    for (const json& r : run.facts().at("runs")) {
      if (!r.at("failure").get<std::string>().empty()) continue;
      found.insert(r.at("executor").get<std::string>() + "," +
                   std::to_string(r.at("repetition").get<std::uint32_t>()) + ",");
    }
    return found;
  });
}

/// Copies the header and the rows that begin like one of these. A last line without its end is none.
void copy_rows(const fs::path& from, const Beginnings& kept, std::ostream& out) {
  std::ifstream in = open_input(from, "take the file away to recover the others");
  std::string line;
  for (bool header = true; std::getline(in, line) && !in.eof(); header = false) {
    const std::size_t end = line.find(',', line.find(',') + 1);
    if (header || (end != std::string::npos && kept.contains(line.substr(0, end + 1)))) out << line << '\n';
  }
  if (!in.eof()) out.setstate(std::ios::badbit);
}

/// Removes what a kill left of a file that was being replaced.
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
  StoredRun killed(folder, "recover");
  // A run says how it ended last of all: killed just before, it has every file and says nothing.
  const bool ended = killed.check([&] {
    const json& facts = killed.facts();
    return facts.at("complete").get<bool>() || facts.at("partial").get<bool>() ||
           !facts.at("failures").empty();
  });
  const bool grows = fs::exists(folder / "jobs.csv.part") || fs::exists(folder / "chains.csv.part");
  if (ended && !grows && fs::exists(folder / "summary.json")) {
    killed.fail("all that was measured is there; `hotpath summarize` reads it");
  }
  const int lock = RunFolder::lock(folder);
  if (lock < 0 && fs::exists(folder / "jobs.csv.part")) {
    killed.fail("the run still goes on; end it with Ctrl-C");
  }
  const Beginnings kept = measured_repetitions(killed);
  if (kept.empty()) killed.fail("it was killed before its first repetition had ended; run it again");

  for (const char* name : {"jobs.csv", "chains.csv"}) {
    const fs::path whole = folder / name, grown = whole.string() + ".part";
    if (!fs::exists(grown)) continue;  // killed after it had got its name
    write_whole_file(whole, [&](std::ostream& out) { copy_rows(grown, kept, out); });
    fs::remove(grown);
  }
  if (lock >= 0) close(lock);
  remove_unfinished(folder);

  const StoredRun run(folder, "recover");
  Summary summary = summarize(run, run.summary_options());
  write_whole_file(folder / "summary.json", json(summary));
  json facts = run.facts();
  facts["partial"] = true;
  facts["warnings"].push_back("The run was killed: what it had stored until then was recovered.");
  write_whole_file(folder / "run.json", facts);
  return summary;
}

}  // namespace hotpath
