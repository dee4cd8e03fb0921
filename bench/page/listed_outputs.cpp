// SPDX-License-Identifier: Apache-2.0
#include "page/listed_outputs.hpp"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "explain/totals.hpp"

namespace hotpath::page {

using explain::Explanation;
using explain::Output;

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

void ListedOutputs::add(const Explanation& e) {
  const JobRecord& sink = e.path.back();
  outputs_.add({e.repetition, static_cast<std::int64_t>(sink.job.sequence),
                sink.finish.time_since_epoch().count(), e.latency.count(), e.complete});
  explain::Totals totals;
  totals.add(e);
  for (std::size_t c = 0; c < causes_.size(); ++c) causes_[c].push_back(totals.causes[c].count());
  parts_.push_back(static_cast<std::int64_t>(e.parts.size()));
  for (const explain::Part& part : e.parts) {
    const bool other = part.behind.task != kNoTask;
    part_.add({static_cast<std::int64_t>(part.cause), static_cast<std::int64_t>(part.rule),
               static_cast<std::int64_t>(part.step), other ? static_cast<std::int64_t>(part.behind.task) : -1,
               other ? static_cast<std::int64_t>(part.behind.sequence) : -1, part.length.count()});
  }
  steps_.push_back(static_cast<std::int64_t>(e.path.size()));
  for (const JobRecord& job : e.path) step_.add({job.job.task, static_cast<std::int64_t>(job.job.sequence)});
}

std::vector<std::size_t> ListedOutputs::by_latency() const {
  const Column& latency = outputs_.columns[3];
  std::vector<std::size_t> order(latency.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t i) { return latency[i]; });
  return order;
}

bool ListedOutputs::keep_parts(std::size_t most) {
  if (part_.size() <= most) return false;
  std::vector<bool> kept(parts_.size(), false);
  for (const std::size_t i : by_latency()) {
    const auto parts = static_cast<std::size_t>(parts_[i]);
    if (parts > most) break;
    kept[i] = true;
    most -= parts;
  }
  for (Column& column : part_.columns) {
    auto from = column.begin(), to = column.begin();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const auto end = from + parts_[i];
      to = kept[i] ? std::copy(from, end, to) : to;
      from = end;
    }
    column.erase(to, column.end());
  }
  for (std::size_t i = 0; i < kept.size(); ++i) parts_[i] *= kept[i];
  return true;
}

nlohmann::json ListedOutputs::columns() const {
  nlohmann::json all = outputs_.json();
  all.update({{"causes_ns", causes_},
              {"parts", parts_},
              {"part", part_.json()},
              {"steps", steps_},
              {"step", step_.json()}});
  return all;
}

std::map<std::uint32_t, std::vector<Interval>> ListedOutputs::worst(std::size_t most) const {
  std::vector<std::size_t> order = by_latency();
  order.resize(std::min(order.size(), most));
  std::map<std::uint32_t, std::vector<Interval>> intervals;
  const auto& [repetition, sequence, ends, latencies, complete] = outputs_.columns;
  for (const std::size_t i : order) {
    const Duration latency(latencies[i]);
    const Time end{Duration(ends[i])};
    intervals[static_cast<std::uint32_t>(repetition[i])].emplace_back(end - latency - latency / 2,
                                                                      end + latency / 2);
  }
  return intervals;
}

}  // namespace hotpath::page
