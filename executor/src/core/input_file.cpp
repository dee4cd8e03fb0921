// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/input_file.hpp"

#include <cerrno>
#include <istream>
#include <system_error>

#include "hotpath/core/input_error.hpp"

namespace hotpath {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kFirstBytes = 1 << 14, kMostBytes = 1 << 22;

std::string kind_of(fs::file_type type) {
  switch (type) {
    case fs::file_type::directory:
      return "a folder";
    case fs::file_type::fifo:
      return "a FIFO, which may have no writer";
    case fs::file_type::character:
    case fs::file_type::block:
      return "a device, which may have no end";
    default:
      return "not a regular file";
  }
}

}  // namespace

std::ifstream open_input(const fs::path& file, const std::string& remedy) {
  const auto fail = [&](const std::string& problem) { throw InputError(file.string(), 0, problem, remedy); };
  std::error_code error;
  const fs::file_type type = fs::status(file, error).type();
  if (error) fail("the file cannot be opened (" + error.message() + ")");
  if (type != fs::file_type::regular) fail("the file cannot be read: it is " + kind_of(type));
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) fail("the file cannot be opened (" + std::generic_category().message(errno) + ")");
  return in;
}

LineReader::LineReader(std::istream& in, std::string file, std::size_t lines_before)
    : in_(&in), file_(std::move(file)), line_(lines_before), buffer_(kFirstBytes, '\0') {}

bool LineReader::next() {
  std::size_t bytes = 0;
  const auto fail = [&](const std::string& problem, const std::string& remedy) {
    throw InputError(file_, static_cast<std::int64_t>(line_), problem, remedy);
  };
  for (;;) {
    in_->getline(buffer_.data() + bytes, static_cast<std::streamsize>(buffer_.size() - bytes));
    if (in_->bad()) fail("the file cannot be read further", "check the disk");
    bytes += static_cast<std::size_t>(in_->gcount());
    if (in_->fail() && bytes == 0) return false;
    if (in_->eof() || !in_->fail()) break;
    if (buffer_.size() >= kMostBytes) {
      ++line_;
      fail("the line has more than 4 MiB", "give a text file");
    }
    buffer_.resize(2 * buffer_.size());
    in_->clear();
  }
  ++line_;
  text_ = std::string_view(buffer_).substr(0, in_->eof() ? bytes : bytes - 1);
  if (text_.ends_with('\r')) text_.remove_suffix(1);
  return true;
}

}  // namespace hotpath
