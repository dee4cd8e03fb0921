// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/callback.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

bool same_rule(const Publication& a, const Publication& b) {
  return std::tie(a.topic, a.rule, a.of, a.n, a.first) == std::tie(b.topic, b.rule, b.of, b.n, b.first);
}

bool Callback::waits_for_sets() const {
  return !publishes.empty() &&
         std::ranges::count(publishes, PublishRule::all_new, &Publication::rule) == std::ssize(publishes);
}

std::vector<Duration> values_of(const std::vector<DurationQuantile>& quantiles) {
  constexpr std::size_t kValues = 200;
  std::vector<Duration> values;
  auto next = quantiles.begin() + 1;
  for (std::size_t i = 0; i < kValues; ++i) {
    const double percent = 100 * (static_cast<double>(i) + 0.5) / kValues;
    while (percent > next->percent) ++next;
    const DurationQuantile& before = *std::prev(next);
    const double share = (percent - before.percent) / (next->percent - before.percent);
    values.push_back(before.time +
                     Duration(std::llround(share * static_cast<double>((next->time - before.time).count()))));
  }
  values.front() = quantiles.front().time;
  values.back() = quantiles.back().time;
  return values;
}

bool operator==(const Callback& a, const Callback& b) {
  const auto plain = [](const Callback& c) {
    return std::tie(static_cast<const StatedTimer&>(c), c.task, c.input, c.worst, c.best, c.quantiles,
                    c.group, c.publishes, c.stores_only, c.entity);
  };
  const bool same_times = a.measured && b.measured ? *a.measured == *b.measured : a.measured == b.measured;
  return plain(a) == plain(b) && same_times;
}

std::vector<Callback> callbacks_of(const Node& node) {
  std::vector<Callback> callbacks = node.callbacks;
  std::vector<bool> stored(node.inputs.size(), false);
  for (const Callback& callback : callbacks)
    for (const Publication& publication : callback.publishes)
      for (const std::uint32_t input : publication.of) stored[input] = true;
  for (Callback& c : callbacks) c.stores_only = c.input && stored[*c.input] && c.publishes.empty();
  return callbacks;
}

}  // namespace hotpath
