// SPDX-License-Identifier: Apache-2.0
#include "results/run_folder.hpp"

#include <cerrno>
#include <cstring>

#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace fs = std::filesystem;

RunFolder::RunFolder(const fs::path& path) : path_(path) {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) {
    throw UsageError("the output folder " + path_.string() + " cannot be created (" + error.message() +
                     "); name another with --output");
  }
  for (const char* file : {"run.json", "jobs.csv", "jobs.csv.part"}) {
    if (!fs::exists(path_ / file, error)) continue;
    throw UsageError("the output folder " + path_.string() +
                     " holds a run already; name another with --output, or remove it");
  }
  errno = 0;
  jobs_.open(path_ / "jobs.csv.part", std::ios::binary);
  chains_.open(path_ / "chains.csv.part", std::ios::binary);
  if (!jobs_ || !chains_) {
    throw UsageError("the output folder " + path_.string() + " cannot be written (" + std::strerror(errno) +
                     "); name another with --output");
  }
  jobs_ << kJobsCsvHeader << '\n';
  chains_ << kChainsCsvHeader << '\n';
}

void RunFolder::write(const std::string& name, const std::string& content) const {
  const fs::path part = path_ / (name + ".part");
  std::ofstream out(part, std::ios::binary);
  out << content << std::flush;
  if (!out) {
    const int cause = errno;
    std::error_code ignored;
    fs::remove(part, ignored);
    fail(name, cause);
  }
  rename_part(name);
}

void RunFolder::append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace) {
  write_jobs_csv(jobs_, set, trace);
  if (!jobs_.flush()) fail("jobs.csv.part", errno);
  write_chains_csv(chains_, chain_names, trace);
  if (!chains_.flush()) fail("chains.csv.part", errno);
}

void RunFolder::finish() {
  jobs_.close();
  if (!jobs_) fail("jobs.csv.part", errno);
  chains_.close();
  if (!chains_) fail("chains.csv.part", errno);
  rename_part("jobs.csv");
  rename_part("chains.csv");
}

void RunFolder::rename_part(const std::string& name) const {
  std::error_code error;
  fs::rename(path_ / (name + ".part"), path_ / name, error);
  if (error) fail(name, error.value());
}

void RunFolder::fail(const std::string& name, int cause) const {
  throw RunError("cannot write " + (path_ / name).string() + " (" + std::strerror(cause) +
                 "); what was written before is kept, but the run is not complete");
}

}  // namespace hotpath
