// SPDX-License-Identifier: Apache-2.0
#include "hotpath/bench/result_folder.hpp"

#include <cerrno>
#include <cstring>

#include "hotpath/bench/errors.hpp"
#include "hotpath/core/trace_csv.hpp"

namespace hotpath {

namespace fs = std::filesystem;

ResultFolder::ResultFolder(const fs::path& path) : path_(path) {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) {
    throw UsageError("the output folder " + path_.string() + " cannot be created (" + error.message() +
                     "); name another with --output");
  }
  if (fs::exists(path_ / "run.json") || fs::exists(path_ / "jobs.csv.part")) {
    throw UsageError("the output folder " + path_.string() +
                     " holds a run already; name another with --output, or remove it");
  }
  jobs_.open(path_ / "jobs.csv.part", std::ios::binary);
  const int cause = errno;
  chains_.open(path_ / "chains.csv.part", std::ios::binary);
  if (!jobs_ || !chains_) {
    throw UsageError("the output folder " + path_.string() + " cannot be written (" + std::strerror(cause) +
                     "); name another with --output");
  }
  jobs_ << kJobsCsvHeader << '\n';
  chains_ << kChainsCsvHeader << '\n';
}

void ResultFolder::write(const std::string& name, const std::string& content) const {
  const fs::path part = path_ / (name + ".part");
  {
    std::ofstream out(part, std::ios::binary);
    out << content << std::flush;
    check(out, name.c_str());
  }
  fs::rename(part, path_ / name);
}

void ResultFolder::append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace,
                          const std::vector<ChainRecord>& counted_chains) {
  write_jobs_csv(jobs_, set, trace);
  Trace counted;
  counted.executor = trace.executor;
  counted.repetition = trace.repetition;
  counted.chains = counted_chains;
  write_chains_csv(chains_, chain_names, counted);
  jobs_.flush();
  chains_.flush();
  check(jobs_, "jobs.csv.part");
  check(chains_, "chains.csv.part");
}

void ResultFolder::finish() {
  for (auto* stream : {&jobs_, &chains_}) stream->close();
  check(jobs_, "jobs.csv.part");
  check(chains_, "chains.csv.part");
  fs::rename(path_ / "jobs.csv.part", path_ / "jobs.csv");
  fs::rename(path_ / "chains.csv.part", path_ / "chains.csv");
}

void ResultFolder::check(std::ofstream& stream, const char* name) const {
  if (stream) return;
  const int cause = errno;
  throw RunError("cannot write " + (path_ / name).string() + " (" + std::strerror(cause) +
                 "); what was written before is kept, but the run is not complete");
}

}  // namespace hotpath
