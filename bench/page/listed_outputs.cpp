// SPDX-License-Identifier: Apache-2.0
#include "page/listed_outputs.hpp"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "explain/explain.hpp"

namespace hotpath::page {

using explain::Explanation;
using explain::Output;
using nlohmann::json;

std::vector<Output> listed(const std::vector<Output>& outputs, std::size_t most) {
  if (outputs.size() <= most) return outputs;
  std::vector<std::size_t> worst(outputs.size());
  std::iota(worst.begin(), worst.end(), 0U);
  std::ranges::stable_sort(worst, std::greater<>(), [&](std::size_t i) { return outputs[i].latency; });
  std::vector<bool> chosen(outputs.size(), false);
  const std::size_t half = most / 2, others = most - half;
  for (std::size_t i = 0; i < half; ++i) chosen[worst[i]] = true;
  for (std::size_t i = 0; i < others; ++i) chosen[i * outputs.size() / others] = true;
  std::vector<Output> some;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (chosen[i]) some.push_back(outputs[i]);
  }
  return some;
}

json outputs_json(std::vector<Explanation>& explained, std::size_t most_parts) {
  std::ranges::stable_sort(explained, std::greater<>(), &Explanation::latency);
  json outputs = json::array();
  for (const Explanation& e : explained) {
    explain::Totals totals;
    totals.add(e);
    json causes = json::array(), parts = json::array(), path = json::array();
    for (const auto& cause : explain::kCauseTexts) causes.push_back(totals.sum(cause.value).count());
    const bool fits = e.parts.size() <= most_parts;
    most_parts = fits ? most_parts - e.parts.size() : 0;
    for (const explain::Part& p : fits ? e.parts : std::vector<explain::Part>()) {
      const bool other = p.behind.task != kNoTask;
      parts.push_back({static_cast<int>(p.cause), static_cast<int>(p.rule), p.step,
                       other ? json(p.behind.task) : json(-1), other ? json(p.behind.sequence) : json(-1),
                       p.length.count()});
    }
    for (const JobRecord& job : e.path) path.push_back({job.job.task, job.job.sequence});
    const JobRecord& sink = e.path.back();
    outputs.push_back({{"repetition", e.repetition},
                       {"sequence", sink.job.sequence},
                       {"end", sink.finish.time_since_epoch().count()},
                       {"latency", e.latency.count()},
                       {"causes", causes},
                       {"parts", parts},
                       {"path", path}});
  }
  return outputs;
}

}  // namespace hotpath::page
