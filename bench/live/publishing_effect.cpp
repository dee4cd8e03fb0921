// SPDX-License-Identifier: Apache-2.0
#include "live/publishing_effect.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// Hot-path latencies (ms) of one chain, either in the published repetitions or in the others.
RepeatedSamples samples_of(const results::ExecutorRuns& runs, std::size_t chain, bool published) {
  std::vector<std::vector<double>> samples;
  for (const results::Repetition& repetition : runs.repetitions) {
    if (published_by_turns(repetition.trace.repetition) != published) continue;
    std::vector<double>& latencies = samples.emplace_back();
    for (const ChainRecord& r : repetition.trace.chains) {
      if (r.chain == chain) latencies.push_back(to_ms(r.hot_path_latency));
    }
  }
  return RepeatedSamples(std::move(samples));
}

double percent(double ratio) { return 100 * (ratio - 1); }

}  // namespace

std::vector<PublishingEffect> publishing_effects(const std::vector<results::ExecutorRuns>& runs,
                                                 const results::SummaryOptions& options) {
  std::vector<PublishingEffect> effects;
  for (const results::ExecutorRuns& of_executor : runs) {
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
  out << "\nChange of the median hot-path latency by live publishing:\n";
  for (const PublishingEffect& e : effects) {
    const double change = percent(e.median_ratio.value);
    out << "  " << e.executor << ", " << e.chain << ": ";
    if (const auto& interval = e.median_ratio.interval) {
      out << program::text("%+.2f %% [%+.2f, %+.2f], 95 %% interval over repetitions\n", change,
                           percent(interval->low), percent(interval->high));
    } else if (std::isnan(change)) {
      out << "one side has no samples; measure longer\n";
    } else {
      out << program::text("%+.2f %%; an interval needs at least four repetitions\n", change);
    }
  }
}

void to_json(nlohmann::json& j, const PublishingEffect& effect) {
  j = {{"executor", effect.executor},
       {"chain", effect.chain},
       {"n_live", effect.samples_with},
       {"n_not_live", effect.samples_without},
       {"median_ratio", effect.median_ratio}};
}

}  // namespace hotpath::live
