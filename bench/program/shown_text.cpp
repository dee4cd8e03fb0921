// SPDX-License-Identifier: Apache-2.0
#include "program/shown_text.hpp"

#include <bit>
#include <cstdio>
#include <iostream>
#include <streambuf>
#include <string_view>

#include "hotpath/core/utf8.hpp"

namespace hotpath::program {

namespace {

std::streambuf* unfiltered = nullptr;  // of standard output, during the life of a PrintableStreams

/// Number of trailing bytes that form an incomplete UTF-8 character.
std::size_t begun_character(std::string_view text) {
  for (std::size_t bytes = 1; bytes <= std::min<std::size_t>(text.size(), 3); ++bytes) {
    const auto ones =
        static_cast<std::size_t>(std::countl_one(static_cast<unsigned char>(text[text.size() - bytes])));
    if (ones != 1) return ones > bytes && ones <= 4 ? bytes : 0;  // 1: in the middle of a character
  }
  return 0;
}

}  // namespace

class PrintableStreams::Buffer final : public std::streambuf {
 public:
  explicit Buffer(std::ostream& stream) : stream_(stream), to_(stream.rdbuf(this)) {}
  ~Buffer() override {
    write(pending_.size());
    stream_.rdbuf(to_);
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  std::streambuf* unfiltered() const { return to_; }

 private:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char character = traits_type::to_char_type(c);
    return xsputn(&character, 1) == 1 ? c : traits_type::eof();
  }
  std::streamsize xsputn(const char* text, std::streamsize size) override {
    pending_.append(text, static_cast<std::size_t>(size));
    const std::size_t line = pending_.rfind('\n');
    return line == std::string::npos || write(line + 1) ? size : 0;
  }
  int sync() override {
    return write(pending_.size() - begun_character(pending_)) && to_->pubsync() == 0 ? 0 : -1;
  }

  bool write(std::size_t size) {
    std::string shown;
    for (std::size_t from = 0; from < size;) {
      const std::size_t end = std::min(pending_.find_first_of("\n\t", from), size);
      shown += printable(std::string_view(pending_).substr(from, end - from));
      if (end < size) shown += pending_[end];
      from = end + 1;
    }
    pending_.erase(0, size);
    const auto bytes = static_cast<std::streamsize>(shown.size());
    return to_->sputn(shown.data(), bytes) == bytes;
  }

  std::ostream& stream_;
  std::streambuf* to_;
  std::string pending_;
};

PrintableStreams::PrintableStreams()
    : out_(std::make_unique<Buffer>(std::cout)), errors_(std::make_unique<Buffer>(std::cerr)) {
  unfiltered = out_->unfiltered();
}

PrintableStreams::~PrintableStreams() { unfiltered = nullptr; }

std::ostream& data_output() {
  if (unfiltered == nullptr) return std::cout;
  std::cout << std::flush;
  static std::ostream data(nullptr);
  data.rdbuf(unfiltered);
  return data;
}

void replace_terminal_line(const std::string& text) {
  std::fprintf(stderr, "\r\033[K%s", printable(text).c_str());
  std::fflush(stderr);
}

std::string markdown(const std::string& text) {
  std::string shown;
  for (const char c : printable(text)) {
    const bool is_markup = std::string_view("\\`*|[]~").find(c) != std::string_view::npos;
    shown += c == '<' ? "&lt;" : c == '&' ? "&amp;" : is_markup ? std::string{'\\', c} : std::string{c};
  }
  return shown;
}

}  // namespace hotpath::program
