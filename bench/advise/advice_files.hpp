// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "advise/prediction.hpp"
#include "results/stored_summary.hpp"

/// The files of an advice. The functions throw RunError if a file cannot be written.
namespace hotpath::advise {

/// Writes executor.yaml and the graph.yaml that it names into the folder: the options with which
/// hotpath_rclcpp's PriorityExecutor runs the candidate in each process. Returns the files, none for
/// wait-set executors, which are rclcpp's own, and for deployments to different executors.
/// `platform` replaces the candidate's costs in graph.yaml. `offsets`: a file of phases in the same
/// folder; empty: none.
std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets,
                                              const std::filesystem::path& folder);

/// Writes the recommended candidate as deployment.yaml, and as far as they can express it as the executor
/// files. Returns deployment.yaml.
std::string write_change(const Candidate& candidate, const Graph& graph, const std::filesystem::path& folder);

/// Text to paste that installs the executor files of the folder, with `shown` as its path; empty: it has
/// none.
std::string installation(const std::filesystem::path& folder, const std::filesystem::path& shown);

/// Stores the first draw of a candidate in `folder`: graph.yaml with the candidate's costs and priorities,
/// deployment.yaml for a deployment, and run/, the run of `hotpath simulate` that repeats the draw. Returns
/// the executor's label in the run. Throws UsageError, and OverloadError if the candidate cannot keep up.
std::string store_first_draw(const Candidate& candidate, const setup::CommonOptions& options,
                             const std::filesystem::path& folder);

/// Writes the latencies of one chain in all draws, in the format of chains.csv, and returns them.
results::SampleRows write_latencies(const std::filesystem::path& file,
                                    const std::vector<Prediction>& predictions, std::size_t chain);

}  // namespace hotpath::advise
