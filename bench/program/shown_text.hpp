// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <memory>
#include <string>

namespace hotpath::program {

// Text for people may contain untrusted names of graphs, traces and files. Each medium has one
// function that escapes control sequences of the medium. CSV, JSON, YAML and DOT are data and keep
// names unchanged.

/// During its lifetime, standard output and standard error escape control characters and changes of
/// text direction like printable(), except line breaks and tabs.
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

/// Standard output for data that other programs read: without escapes.
[[nodiscard]] std::ostream& data_output();

/// Replaces the last line on the terminal of standard error.
void replace_terminal_line(const std::string& text);

/// Escapes text for a line or a table cell of Markdown, so that it contains neither HTML nor
/// markup.
[[nodiscard]] std::string markdown(const std::string& text);

}  // namespace hotpath::program
