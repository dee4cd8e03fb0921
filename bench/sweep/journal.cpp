// SPDX-License-Identifier: Apache-2.0
#include "sweep/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"
#include "program/hash.hpp"
#include "program/json_record.hpp"
#include "program/output_target.hpp"
#include "program/table.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr auto kFlushEvery = std::chrono::seconds(1);
constexpr const char *kJournal = "cells.journal", *kFacts = "sweep.json";

/// A hash that differs between builds of the running program.
std::uint64_t build_fingerprint() {
  const std::ifstream own("/proc/self/exe", std::ios::binary);
  return program::hash_of((std::ostringstream() << own.rdbuf()).view());
}

/// A line of the journal: checksum, space, JSON (so that a row may have line breaks).
std::string line_of(std::uint64_t cell, const std::string& rows) {
  const std::string record = json{cell, rows}.dump();
  return program::text("%08lx ", crc32_z(0, reinterpret_cast<const Bytef*>(record.data()), record.size())) +
         record + "\n";
}

/// The cell and its rows in a line of the journal; std::nullopt: the line is damaged.
std::optional<std::pair<std::uint64_t, std::string>> parse(const std::string& line) {
  const json read = json::parse(line.substr(std::min(line.find(' '), line.size())), nullptr, false);
  if (!read.is_array() || read.size() != 2 || !read[0].is_number_unsigned() || !read[1].is_string())
    return std::nullopt;
  const std::pair<std::uint64_t, std::string> parsed{read[0], read[1]};
  return line_of(parsed.first, parsed.second) == line + "\n" ? std::optional(parsed) : std::nullopt;
}

[[noreturn]] void refuse(const auto&... problem) {
  throw program::UsageError(program::concat("--output: ", problem..., "give a new folder"));
}

/// Throws UsageError if the folder holds the results of another sweep or build.
void check_same_sweep(const fs::path& folder, const Design& design) {
  std::ifstream in = open_input(folder / kFacts, "give a new folder");
  std::string version;
  bool same_build = false;
  try {
    const json facts = program::parse_shallow(in);
    version = facts.value("version", "unknown");
    same_build = facts.value("build", std::uint64_t{0}) == build_fingerprint();
  } catch (const std::exception&) {
    refuse((folder / kFacts).string(), " is damaged; ");
  }
  if (read_text_file(folder / "sweep.yaml") != design.text)
    refuse(folder.string(), " holds results of another sweep than ", design.file,
           " (see sweep.yaml there); ");
  if (!same_build)
    refuse(folder.string(), " was begun by another build of hotpath (version ", version,
           "), whose results may differ; continue with that build, or ");
}

}  // namespace

Journal::Journal(fs::path folder, const Design& design)
    : folder_(std::move(folder)), file_(folder_ / kJournal), cells_(design.cells()) {
  std::error_code unknown;
  program::check_output_folder(folder_, fs::exists(folder_ / kFacts, unknown) ? kFacts : kJournal);
  program::create_folder(folder_);
  open();
  // All other files of the folder are read and written under the lock.
  if (fs::exists(folder_ / kFacts)) {
    check_same_sweep(folder_, design);
    read_back();
    // Syncs the name of a new journal. Below, writing a new sweep.json syncs both names.
    if (const std::error_code error = program::await_disk(folder_)) fail(error.value());
    return;
  }
  if (fs::is_regular_file(file_) && fs::file_size(file_) > 0)
    refuse(folder_.string(), " holds results of a sweep without its ", kFacts, "; ");
  program::write_whole_file(folder_ / "sweep.yaml", "--output", design.text);
  json axes = json::array();
  for (const Axis& axis : design.axes) axes.push_back(axis.name);
  program::write_whole_file(folder_ / kFacts, "--output",
                            json{{"version", HOTPATH_VERSION},
                                 {"build", build_fingerprint()},
                                 {"command", design.command},
                                 {"axes", axes},
                                 {"cells", design.cells()},
                                 {"repetitions", design.repetitions}});
}

void Journal::read_back() {
  if (!fs::is_regular_file(file_)) return;  // a device, which may have no end
  std::ifstream in(file_);
  std::uintmax_t whole = 0, at = 0;  // bytes up to the last intact line, and up to this one
  std::size_t number = 0, damaged = 0, damaged_before = 0, first_damaged = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    at += line.size() + 1;
    const auto parsed = in.eof() ? std::nullopt : parse(line);
    if (!parsed && damaged++ == 0) first_damaged = number;
    if (!parsed) continue;
    whole = at;
    damaged_before = damaged;
    if (parsed->first < cells_) rows_.insert(*parsed);
  }
  done_ = rows_.size();
  if (in.bad()) fail(errno);
  if (damaged_before > 0) {
    notes_.push_back(program::text(
        "%s:%zu: the first of %zu damaged lines, which are ignored; cells without an intact line run again",
        file_.c_str(), first_damaged, damaged_before));
  }
  // The rest was being written when the sweep ended, or is damaged as well.
  const std::uintmax_t size = fs::file_size(file_);
  if (size == whole) return;
  if (truncate(file_.c_str(), static_cast<off_t>(whole)) != 0) fail(errno);
  notes_.push_back(program::concat(file_.string(), ": the last ", size - whole,
                                   " bytes are an incomplete line and were removed; their cells run again"));
}

void Journal::open() {
  const int descriptor = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(errno);
  out_.emplace(descriptor);
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK)
    refuse("another process runs the sweep in ", folder_.string(), "; wait until it ends, or ");
  notes_.push_back(
      program::concat(file_.string(), ": ", std::strerror(errno),
                      ": the file cannot be locked; do not start a second sweep in this folder"));
}

void Journal::fail(int error) const {
  throw program::RunError(program::concat(file_.string(), ": ", std::strerror(error), "; ", done_,
                                          " cells are stored there, and the same command continues with the "
                                          "others"));
}

std::vector<std::uint64_t> Journal::missing() const {
  std::vector<std::uint64_t> cells;
  for (std::uint64_t cell = 0; cell < cells_; ++cell) {
    if (!rows_.contains(cell)) cells.push_back(cell);
  }
  return cells;
}

void Journal::add(std::uint64_t cell, const std::string& rows) {
  if (!(*out_ << line_of(cell, rows))) fail(errno);
  rows_[cell] = rows;
  if (std::chrono::steady_clock::now() - flushed_ > kFlushEvery) flush();
}

void Journal::flush() {
  if (!*out_) return;  // as reported before
  flushed_ = std::chrono::steady_clock::now();
  if (!out_->flush()) fail(errno);
  if (const std::error_code error = program::await_disk(file_)) fail(error.value());
  done_ = rows_.size();
}

void Journal::write_table(const std::vector<std::string>& columns) const {
  program::Table table("", columns);
  for (const auto& [cell, rows] : rows_) {
    for (const json& row : json::parse(rows)) table.rows.emplace_back(row.begin(), row.end());
  }
  program::write_whole_file(folder_ / "table.csv", csv_of(table));
  json facts = json::parse(read_text_file(folder_ / kFacts));
  facts.update(columns_and_rows(table));
  program::write_whole_file(folder_ / kFacts, facts.dump() + "\n");
}

}  // namespace hotpath::sweep
