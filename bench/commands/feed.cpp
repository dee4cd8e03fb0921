// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "page/page_data.hpp"
#include "program/shown_text.hpp"
#include "results/stored_run.hpp"
#include "results/stored_summary.hpp"
#include "results/trace_window.hpp"

namespace hotpath::commands {

namespace {

/// What the Python package draws, on standard output.
struct Feed {
  std::string run, executor;
  std::vector<std::string> runs;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};

void feed_page(const Feed& feed) {
  using nlohmann::json;
  program::data_output() << page::page_data(feed.runs).dump(-1, ' ', false, json::error_handler_t::replace)
                         << "\n";
}

void feed_golden(const Feed& feed) {
  program::data_output() << results::summarize_golden_trace(feed.run).dump(2) << "\n";
}

void feed_responses(const Feed& feed) {
  const results::StoredRun run(feed.run, "report");
  results::write_responses(program::data_output(), run);
}

void feed_jobs(const Feed& feed) {
  const results::StoredRun run(feed.run, "report");
  results::TraceWindow window{feed.executor, feed.repetition};
  if (window.executor.empty() && !run.executors().empty()) window.executor = run.executors().front();
  static_cast<void>(run.run(window.executor, window.repetition));  // throws if it did not run
  // Widened by a nanosecond, because Python selects jobs in milliseconds.
  window.from = Time{} + from_ms(feed.from_ms) - Duration(1);
  if (feed.to_ms) window.to = Time{} + from_ms(*feed.to_ms) + Duration(1);
  results::write_window(program::data_output(), run.folder() / "jobs.csv", window);
}

}  // namespace

void add_feed_command(CLI::App& app) {
  CLI::App& parent = *app.add_subcommand("feed", "Data for the Python package")->group("");
  parent.require_subcommand(1);
  auto [page, of_page] = add_command<Feed>(parent, "page", "", "", feed_page);
  page.add_option("RUN", of_page.runs)->required();
  auto [golden, of_golden] = add_command<Feed>(parent, "golden", "", "", feed_golden);
  golden.add_option("FILE", of_golden.run)->required();
  auto [responses, of_responses] = add_command<Feed>(parent, "responses", "", "", feed_responses);
  responses.add_option("RUN", of_responses.run)->required();
  auto [jobs, of_jobs] = add_command<Feed>(parent, "jobs", "", "", feed_jobs);
  jobs.add_option("RUN", of_jobs.run)->required();
  add_text(jobs, "--executors", of_jobs.executor, "NAME", "");
  add_number(jobs, "--repetition", of_jobs.repetition, {0, 1e9}, "N", "");
  add_number(jobs, "--from", of_jobs.from_ms, {-1e12, 1e12}, "MS", "");
  add_number(jobs, "--to", of_jobs.to_ms, {-1e12, 1e12}, "MS", "");
}

const Command kFeed("", 190, add_feed_command);

}  // namespace hotpath::commands
