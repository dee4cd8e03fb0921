// SPDX-License-Identifier: Apache-2.0
#include "import/caret_drafts.hpp"

#include <algorithm>

#include "import/imported_graph.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

double hertz_of(Duration period) { return 1e9 / static_cast<double>(period.count()); }

void set_quantiles(Callback& c, const std::vector<DurationQuantile>& times) {
  c.best = times.front().time;
  c.worst = times.back().time;
  if (times.size() <= 2) return;
  c.quantiles = times;
  c.measured = std::make_shared<const std::vector<Duration>>(values_of(times));
}

CaretDraft draft_of(const std::string& ros_node, std::size_t n, const CaretCallback& caret,
                    const CaretStats* stats) {
  CaretDraft draft{.node = n, .caret = &caret, .stats = stats, .hertz = 0, .callback = {}};
  Callback& c = draft.callback;
  const std::string node = graph_node_name(ros_node);
  c.task = program::concat(
      node, "/",
      graph_topic_name(caret.topic ? *caret.topic : caret.name.substr(caret.name.find_last_of('/') + 1)));
  if (!caret.topic) c.period = c.deadline = caret.period;
  if (stats != nullptr) {
    draft.hertz = hertz_of(*stats->period);
    if (!stats->times.empty()) set_quantiles(c, stats->times);
  } else if (!caret.topic) {
    draft.hertz = hertz_of(caret.period);
  }
  return draft;
}

}  // namespace

double CaretDrafts::frequency(const std::string& topic) const {
  double most = 0;
  if (const auto readers = subscribers.find(topic); readers != subscribers.end()) {
    for (const std::size_t s : readers->second) {
      if (all[s].stats != nullptr) most = std::max(most, all[s].hertz);
    }
  }
  return most;
}

CaretDrafts make_drafts(const CaretArchitecture& architecture,
                        const std::map<std::string, CaretStats>& stats) {
  CaretDrafts drafts;
  for (std::size_t n = 0; n < architecture.nodes.size(); ++n) {
    std::set<std::string> topics;
    for (const CaretCallback& caret : architecture.nodes[n].callbacks) {
      const auto measured = stats.find(caret.name);
      const bool ran = measured != stats.end() && measured->second.period;
      if (!stats.empty() && !ran) {
        ++drafts.idle;
        continue;
      }
      if (caret.topic && !topics.insert(*caret.topic).second) {
        ++drafts.twice;
        continue;
      }
      const std::size_t index = drafts.all.size();
      drafts.all.push_back(draft_of(architecture.nodes[n].name, n, caret, ran ? &measured->second : nullptr));
      drafts.index[caret.name] = index;
      if (caret.topic) drafts.subscribers[*caret.topic].push_back(index);
    }
  }
  return drafts;
}

}  // namespace hotpath::imports
