// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/input_file.hpp"

#include <cerrno>
#include <istream>
#include <system_error>

namespace hotpath {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostBytes = 1 << 22;  // pages that no line reaches take no memory

std::string kind_of(fs::file_type type) {
  switch (type) {
    case fs::file_type::directory:
      return "it is a folder";
    case fs::file_type::fifo:
      return "it is a FIFO, which may have no writer";
    case fs::file_type::character:
    case fs::file_type::block:
      return "it is a device, which may have no end";
    default:
      return "it is not a regular file";
  }
}

}  // namespace

void refuse_input(const std::string& file, const std::string& reason, const std::string& remedy,
                  std::int64_t line) {
  throw InputError(file, line, "cannot be read (" + reason + ")", remedy);
}

std::ifstream open_input(const fs::path& file, const std::string& remedy) {
  std::error_code error;
  const fs::file_type type = fs::status(file, error).type();
  if (error) refuse_input(file.string(), error.message(), remedy);
  if (type != fs::file_type::regular) refuse_input(file.string(), kind_of(type), remedy);
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse_input(file.string(), std::generic_category().message(errno), remedy);
  return in;
}

LineReader::LineReader(std::istream& in, std::string file)
    : in_(&in), file_(std::move(file)), buffer_(std::make_unique_for_overwrite<char[]>(kMostBytes)) {}

bool LineReader::next() {
  in_->getline(buffer_.get(), kMostBytes);
  if (in_->bad())
    refuse_input(file_, "input/output error after this line", "check the disk",
                 static_cast<std::int64_t>(line_));
  const auto bytes = static_cast<std::size_t>(in_->gcount());
  if (in_->fail() && bytes == 0) return false;
  ++line_;
  if (in_->fail() && !in_->eof()) {
    throw InputError(file_, static_cast<std::int64_t>(line_), "the line has more than 4 MiB",
                     "give a text file");
  }
  text_ = std::string_view(buffer_.get(), in_->eof() ? bytes : bytes - 1);
  if (text_.ends_with('\r')) text_.remove_suffix(1);
  return true;
}

}  // namespace hotpath
