// SPDX-License-Identifier: Apache-2.0
#include "bounds/guarantees.hpp"

#include <algorithm>

namespace hotpath::bounds {

namespace {

void keep_smaller(std::optional<Guarantee>& kept, std::optional<std::int64_t> bound,
                  const std::string& method) {
  if (bound && (!kept || *bound < kept->ns)) kept = {*bound, method};
}

}  // namespace

const ChainGuarantee* Guarantees::chain(const std::string& name) const {
  const auto chain = std::ranges::find(chains, name, &ChainGuarantee::name);
  return chain == chains.end() ? nullptr : &*chain;
}

std::optional<Guarantees> smallest_of(const CallbackGraph& callbacks,
                                      const std::vector<GraphBounds>& all_bounds) {
  Guarantees all;
  all.tasks.resize(callbacks.set.size());
  for (const CallbackGraph::DataChain& chain : callbacks.chains) all.chains.push_back({chain.name, {}, {}});
  bool covered = false;
  for (const GraphBounds& bounds : all_bounds) {
    covered = covered || bounds.refusal.empty();
    for (std::size_t t = 0; t < bounds.tasks.size(); ++t) {
      keep_smaller(all.tasks[t], bounds.tasks[t], bounds.method);
    }
    for (std::size_t c = 0; c < bounds.chains.size(); ++c) {
      if (!bounds.chains[c]) continue;
      keep_smaller(all.chains[c].age, bounds.chains[c]->latency, bounds.method);
      keep_smaller(all.chains[c].hot_path, bounds.chains[c]->hot_path, bounds.method);
    }
  }
  return covered ? std::optional(std::move(all)) : std::nullopt;
}

}  // namespace hotpath::bounds
