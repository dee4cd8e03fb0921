// SPDX-License-Identifier: Apache-2.0
#include "results/run_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"

namespace hotpath::results {

namespace fs = std::filesystem;

namespace {

const std::string kKept = "; earlier results are kept, but the run is not complete";

fs::path new_folder(const fs::path& path) {
  program::check_output_folder(path);
  program::create_folder(path);
  return path;
}

}  // namespace

RunFolder::RunFolder(const fs::path& path)
    : path_(new_folder(path)),
      jobs_(program::create_file(path_ / "jobs.csv.part")),
      chains_(program::create_file(path_ / "chains.csv.part")) {
  const bool created = jobs_ && chains_;
  if (created) lock_ = lock(path_);
  if (lock_ < 0)
    throw program::UsageError(program::concat(
        "the output folder ", path_.string(), created ? " cannot be locked (" : " cannot be written (",
        std::strerror(errno), created ? "); does another run use it?" : "); name another with --output"));
  jobs_ << kJobsCsvHeader << '\n';
  chains_ << kChainsCsvHeader << '\n';
}

RunFolder::~RunFolder() {
  if (lock_ >= 0) ::close(lock_);
}

int RunFolder::lock(const fs::path& path) {
  const int descriptor = open((path / "jobs.csv.part").c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 || flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

void RunFolder::write(const std::string& name, const program::FileContent& content) const {
  try {
    program::write_whole_file(path_ / name, content);
  } catch (const program::RunError& error) {
    throw program::RunError(error.what() + kKept);
  }
}

void RunFolder::close(RunRecord& record, const nlohmann::json& summary) {
  finish();
  if (record.simulation && record.simulation->no_trace) fs::remove(path_ / "jobs.csv");
  write("summary.json", summary);
  for (const nlohmann::json& executor : summary.value("executors", nlohmann::json::array())) {
    const std::vector<std::string> tasks = executor.at("starved");
    if (!tasks.empty())
      record.warnings.push_back(executor.at("executor").get<std::string>() +
                                " starves callbacks: " + program::joined(tasks) + ".");
  }
  record.complete = record.failures.empty() && !record.partial;
  conclude(record);
}

void RunFolder::conclude(RunRecord& record) const {
  try {
    write("run.json", nlohmann::json(record));
  } catch (const std::exception&) {  // RunError, or std::bad_alloc
    record.complete = false;
    try {
      write("run.json", nlohmann::json(record));
    } catch (const std::exception&) {  // the first failure is reported
    }
    throw;
  }
}

void RunFolder::append(const TaskSet& set, const std::vector<std::string>& chain_names, const Trace& trace) {
  write_jobs_csv(jobs_, set, trace);
  if (!jobs_.flush()) fail("jobs.csv.part", errno);
  write_chains_csv(chains_, set, chain_names, trace);
  if (!chains_.flush()) fail("chains.csv.part", errno);
  for (const char* name : {"jobs.csv.part", "chains.csv.part"}) {
    if (const std::error_code error = program::await_disk(path_ / name)) fail(name, error.value());
  }
}

void RunFolder::finish() {
  jobs_.close();
  if (!jobs_) fail("jobs.csv.part", errno);
  chains_.close();
  if (!chains_) fail("chains.csv.part", errno);
  for (const char* name : {"jobs.csv", "chains.csv"}) {
    const std::error_code error = program::name_durably(path_ / (std::string(name) + ".part"), path_ / name);
    if (error) fail(name, error.value());
  }
}

void RunFolder::fail(const std::string& name, int cause) const {
  throw program::RunError(
      program::concat((path_ / name).string(), " cannot be written (", std::strerror(cause), ")", kKept));
}

}  // namespace hotpath::results
