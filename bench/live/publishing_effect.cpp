// SPDX-License-Identifier: Apache-2.0
#include "live/publishing_effect.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ostream>

namespace hotpath {

namespace {

/// Hot-path latencies in milliseconds of one chain in the repetitions that were published, or in the others.
RepeatedSamples samples_of(const ExecutorRuns& runs, std::size_t chain, bool published) {
  std::vector<std::vector<double>> samples;
  for (const Repetition& repetition : runs.repetitions) {
    if (published_by_turns(repetition.trace.repetition) != published) continue;
    std::vector<double>& of_repetition = samples.emplace_back();
    for (const ChainRecord& r : repetition.trace.chains) {
      if (r.chain == chain) of_repetition.push_back(to_ms(r.hot_path_latency));
    }
  }
  return RepeatedSamples(std::move(samples));
}

double percent(double ratio) { return 100 * (ratio - 1); }

}  // namespace

std::vector<PublishingEffect> publishing_effects(const std::vector<ExecutorRuns>& runs,
                                                 const SummaryOptions& options) {
  std::vector<PublishingEffect> effects;
  for (const ExecutorRuns& of_executor : runs) {
    for (std::size_t c = 0; c < options.chains.size(); ++c) {
      const RepeatedSamples with = samples_of(of_executor, c, true);
      const RepeatedSamples without = samples_of(of_executor, c, false);
      effects.push_back({of_executor.executor, options.chains[c], with.pooled().size(),
                         without.pooled().size(), ratio_of_quantiles(with, without, 0.5, options.bootstrap)});
    }
  }
  return effects;
}

void write_publishing_effects(std::ostream& out, const std::vector<PublishingEffect>& effects) {
  out << "\nMedian hot-path latency with live publishing against without:\n";
  for (const PublishingEffect& e : effects) {
    char text[128] = "no samples on one side; measure longer";
    const std::optional<Interval>& interval = e.median_ratio.interval;
    if (interval) {
      std::snprintf(text, sizeof(text), "%+.2f %% [%+.2f, %+.2f], 95 %% interval over repetitions",
                    percent(e.median_ratio.value), percent(interval->low), percent(interval->high));
    } else if (!std::isnan(e.median_ratio.value)) {
      std::snprintf(text, sizeof(text), "%+.2f %%, without interval: four repetitions or more give one",
                    percent(e.median_ratio.value));
    }
    out << "  " << e.executor << ", " << e.chain << ": " << text << "\n";
  }
}

nlohmann::json to_json(const std::vector<PublishingEffect>& effects) {
  nlohmann::json list = nlohmann::json::array();
  for (const PublishingEffect& e : effects) {
    const std::optional<Interval>& interval = e.median_ratio.interval;
    list.push_back({{"executor", e.executor},
                    {"chain", e.chain},
                    {"n_live", e.samples_with},
                    {"n_not_live", e.samples_without},
                    {"median_ratio",
                     {{"value", e.median_ratio.value},
                      {"interval", interval ? nlohmann::json{interval->low, interval->high} : nullptr}}}});
  }
  return list;
}

}  // namespace hotpath
