// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "page/page_data.hpp"
#include "program/shown_text.hpp"
#include "results/stored_run.hpp"
#include "results/stored_summary.hpp"
#include "results/summary.hpp"

namespace hotpath::commands {

namespace {

using nlohmann::json;

/// Answers what the Python package asks: [QUESTION, ARGUMENTS...]. Samples are given once; later questions
/// name them by their number.
class Feed {
 public:
  json answer(const json& asked) {
    const std::string what = asked.at(0);
    const json& first = asked.at(1);
    if (what == "page") return page::page_data(first);
    if (what == "chains") return results::chain_samples({first.get<std::string>(), "report"});
    if (what == "responses") return results::response_samples({first.get<std::string>(), "report"});
    if (what == "golden") return results::summarize_golden_trace(first.get<std::string>());
    if (what == "samples") {
      samples_.push_back(results::resampled(first, asked.at(2)));
      return samples_.size() - 1;
    }
    if (what == "line") {
      const std::vector<double> x = first, y = asked.at(2), weights = asked.at(3);
      const Line line = fit_line(x, y, weights);
      return {line.slope, line.intercept};
    }
    const RepeatedSamples& samples = samples_.at(first);
    if (what == "curve") return results::curve_of(samples);
    if (what == "quantiles") return estimate_quantiles(samples, asked.at(2).get<std::vector<double>>());
    const RepeatedSamples& others = samples_.at(asked.at(2));
    if (what == "ratio") return ratio_of_quantiles(samples, others, asked.at(3));
    if (what == "ranks") return {rank_test(samples, others), cliffs_delta(samples, others)};
    throw RunError("unknown question " + what);
  }

 private:
  std::vector<RepeatedSamples> samples_;
};

/// Answers each line of standard input in a line.
void answer_lines(Feed& feed) {
  for (std::string line; std::getline(std::cin, line);) {
    json answer = {{"version", HOTPATH_VERSION}};
    try {
      answer["answer"] = feed.answer(json::parse(line));
    } catch (const std::exception& error) {
      const bool failed = dynamic_cast<const RunError*>(&error) != nullptr;
      answer.update({{"error", error.what()}, {"wrong_use", !failed}});
    }
    program::data_output() << answer.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
  }
}

}  // namespace

const Command kFeed("", 190, [](CLI::App& app) {
  add_command<Feed>(app, "feed", "Data and statistics for the Python package", "", answer_lines);
});

}  // namespace hotpath::commands
