// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>
#include <string>

namespace hotpath {

// What people read may hold names of others: of graphs, traces, files. Each medium has one function that
// takes from a name what would command the medium. CSV, JSON, YAML and DOT are data, and keep names as they
// are.

/// While it lives, standard output and standard error show control characters, and what turns the direction
/// of text, as printable() does; lines and tabs stay.
class PrintableStreams {
 public:
  PrintableStreams();
  ~PrintableStreams();
  PrintableStreams(const PrintableStreams&) = delete;
  PrintableStreams& operator=(const PrintableStreams&) = delete;

 private:
  class Buffer;
  std::unique_ptr<Buffer> out_, errors_;
};

/// Standard output for data, which other programs read: nothing is changed.
[[nodiscard]] std::ostream& data_output();

/// Replaces the last line of the terminal that standard error is.
void replace_terminal_line(const std::string& text);

/// Text within a line or a cell of a Markdown table: it is read as it stands, and is neither HTML nor markup.
[[nodiscard]] std::string markdown(const std::string& text);

}  // namespace hotpath
