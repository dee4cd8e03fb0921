// SPDX-License-Identifier: Apache-2.0
#include "sweep/journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "hotpath/campaign/crew.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr auto kFlushEvery = std::chrono::seconds(1);

/// A line of the journal. JSON, so that a row may have line breaks, and a torn line is no line.
std::string line_of(std::uint64_t cell, const std::string& rows) { return json{cell, rows}.dump() + "\n"; }

/// What the journal keeps of a line; false for one that was not written to its end.
bool parse(const std::string& line, std::uint64_t& cell, std::string& rows) {
  const json read = json::parse(line, nullptr, false);
  if (!read.is_array() || read.size() != 2 || !read[0].is_number_unsigned() || !read[1].is_string())
    return false;
  cell = read[0].get<std::uint64_t>();
  rows = read[1].get<std::string>();
  return true;
}

void check_same_sweep(const fs::path& folder, const SweepDesign& design) {
  json facts;
  std::ifstream(folder / "sweep.json") >> facts;
  if (read_text_file(folder / "sweep.yaml") != design.text) {
    throw UsageError("--output: " + folder.string() + " holds results of another sweep than " + design.file +
                     " is now (its own is sweep.yaml there); give a new folder");
  }
  if (facts.value("build", std::uint64_t{0}) == build_fingerprint()) return;
  throw UsageError("--output: " + folder.string() + " was begun by another build of hotpath (version " +
                   facts.value("version", "unknown") +
                   "), whose results may differ; go on with that one, or give a new folder");
}

}  // namespace

SweepJournal::SweepJournal(fs::path folder, const SweepDesign& design)
    : folder_(std::move(folder)), file_(folder_ / "cells.journal"), is_done_(design.cells(), false) {
  if (fs::exists(folder_ / "sweep.json")) {
    try {
      check_same_sweep(folder_, design);
    } catch (const json::exception&) {
      throw UsageError("--output: " + (folder_ / "sweep.json").string() + " is damaged; give a new folder");
    }
    read_back();
  } else {
    if (fs::exists(folder_) && !fs::is_empty(folder_)) {
      throw UsageError("--output: " + folder_.string() + " exists and is no sweep; give a new folder");
    }
    create_folder(folder_);
    write_whole_file(folder_ / "sweep.yaml", "--output", design.text);
    json axes = json::array();
    for (const SweepAxis& axis : design.axes) axes.push_back(axis.name);
    write_whole_file(folder_ / "sweep.json", "--output",
                     json{{"version", HOTPATH_VERSION},
                          {"build", build_fingerprint()},
                          {"command", design.command},
                          {"axes", axes},
                          {"cells", design.cells()},
                          {"repetitions", design.repetitions}});
  }
  open();
}

SweepJournal::~SweepJournal() {
  if (descriptor_ >= 0) close(descriptor_);
}

void SweepJournal::read_back() {
  if (!fs::is_regular_file(file_)) return;  // nothing yet, or a device, which may have no end
  std::ifstream in(file_);
  std::string line, rows;
  std::uintmax_t whole = 0;
  std::uint64_t cell = 0;
  while (std::getline(in, line) && !in.eof() && parse(line, cell, rows)) {
    whole += line.size() + 1;
    if (cell >= is_done_.size() || is_done_[cell]) continue;
    is_done_[cell] = true;
    ++done_;
  }
  if (in.bad()) fail();
  // What follows was being written when the sweep ended.
  if (truncate(file_.c_str(), static_cast<off_t>(whole)) != 0) fail();
}

void SweepJournal::open() {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail();
  if (const std::error_code error = await_disk(folder_)) {
    errno = error.value();
    fail();
  }
}

void SweepJournal::fail() const {
  throw RunError(file_.string() + ": " + std::strerror(errno) + "; " + std::to_string(done_) +
                 " cells are kept there, and the same command goes on with the others");
}

void SweepJournal::fail_reading() const {
  throw RunError(file_.string() +
                 ": it cannot be read back whole, so that no table is written; "
                 "the same command tries again");
}

std::vector<std::uint64_t> SweepJournal::missing() const {
  std::vector<std::uint64_t> cells;
  for (std::uint64_t cell = 0; cell < is_done_.size(); ++cell) {
    if (!is_done_[cell]) cells.push_back(cell);
  }
  return cells;
}

void SweepJournal::add(std::uint64_t cell, const std::string& rows) {
  pending_ += line_of(cell, rows);
  is_done_[cell] = true;
  ++pending_cells_;
  if (std::chrono::steady_clock::now() - flushed_ > kFlushEvery) flush();
}

void SweepJournal::flush() {
  flushed_ = std::chrono::steady_clock::now();
  for (std::size_t at = 0; at < pending_.size();) {
    const ssize_t n = write(descriptor_, pending_.data() + at, pending_.size() - at);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail();
    at += static_cast<std::size_t>(n);
  }
  pending_.clear();
  if (fdatasync(descriptor_) != 0) fail();
  done_ += std::exchange(pending_cells_, 0);
}

void SweepJournal::write_table(const std::string& header) {
  std::map<std::uint64_t, std::streamoff> places;
  std::ifstream in(file_);
  std::string line, rows;
  std::uint64_t cell = 0;
  for (std::streamoff at = 0; std::getline(in, line); at = in.tellg()) {
    if (parse(line, cell, rows)) places.emplace(cell, at);
  }
  if (places.size() != is_done_.size() - missing().size()) fail_reading();
  in.clear();
  write_whole_file(folder_ / "table.csv", [&](std::ostream& out) {
    out << header << "\n";
    for (const auto& [number, at] : places) {
      if (!std::getline(in.seekg(at), line) || !parse(line, cell, rows)) fail_reading();
      out << rows;
    }
  });
}

}  // namespace hotpath
