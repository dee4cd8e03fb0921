// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Comments of a written graph.
struct GraphComments {
  std::string header;                     ///< At the top of the file; may have several lines.
  std::map<std::string, std::string> of;  ///< One line each; key: the name of a node or of a callback's task.
};

/// Limit of measured execution times per callback in the graph's own file.
inline constexpr std::size_t kMaxInlineTimes = 20;

/// The graph as text from which load_graph() reads the same graph, including all measured execution
/// times. An unnamed group is read back as mutually exclusive.
[[nodiscard]] std::string graph_yaml(const Graph& graph, const GraphComments& comments = {});

/// Writes a text into a file; creates its folder if necessary.
using TextWriter = std::function<void(const std::filesystem::path& file, const std::string& text)>;

/// A TextWriter without sync to disk. Throws InputError if the file cannot be written.
void write_text_file(const std::filesystem::path& file, const std::string& text);

/// Writes the graph into `file` with `write`. If a callback has more than kMaxInlineTimes measured
/// execution times, they go into a CSV file in a folder beside `file`, called STEM_times after it.
/// The CSV files are written first. Throws InputError if the folder for `file` does not exist, and
/// exceptions of `write`.
void write_graph(const std::filesystem::path& file, const Graph& graph, const GraphComments& comments = {},
                 const TextWriter& write = write_text_file);

}  // namespace hotpath
