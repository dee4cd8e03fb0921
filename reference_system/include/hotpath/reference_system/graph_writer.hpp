// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// What a written graph says to its reader beside the graph.
struct GraphComments {
  std::string header;                     ///< In front of all; may have several lines.
  std::map<std::string, std::string> of;  ///< One line each, by the name of a node or of a callback's task.
};

/// Most measured execution times of a callback that stand in the graph's own file.
inline constexpr std::size_t kMaxInlineTimes = 20;

/// The graph as text that load_graph() reads back as the same graph. All measured execution times are in it.
/// A group without a name is mutually exclusive, as in a file.
[[nodiscard]] std::string graph_yaml(const Graph& graph, const GraphComments& comments = {});

/// Writes a text into a file, whose folder may be missing.
using TextWriter = std::function<void(const std::filesystem::path& file, const std::string& text)>;

/// A TextWriter that does not wait for the disk. Throws InputError when the file cannot be written.
void write_text_file(const std::filesystem::path& file, const std::string& text);

/// Writes the graph into `file`, by `write`. Callbacks with more than kMaxInlineTimes measured execution
/// times have them in CSV files in a folder beside it, which is called STEM_times after the file. They are
/// written first. Throws InputError when there is no folder for `file`, and what `write` throws.
void write_graph(const std::filesystem::path& file, const Graph& graph, const GraphComments& comments = {},
                 const TextWriter& write = write_text_file);

}  // namespace hotpath
