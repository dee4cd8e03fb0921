// SPDX-License-Identifier: Apache-2.0
#include "commands/observed.hpp"

#include <algorithm>

#include "results/measures.hpp"
#include "results/stored_run.hpp"

namespace hotpath {

namespace {

using Key = std::pair<std::string, std::string>;

void keep_largest(std::map<Key, Duration>& largest, Key key, Duration value) {
  const auto [at, inserted] = largest.emplace(std::move(key), value);
  if (!inserted) at->second = std::max(at->second, value);
}

std::optional<Duration> find(const std::map<Key, Duration>& largest, const Key& key) {
  const auto found = largest.find(key);
  return found == largest.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

Observed::Observed(const std::string& folder, const TaskSet& tasks) {
  StoredRun run(folder, "--trace");
  run.load(tasks);
  for (const Trace& trace : run.traces()) {
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome != Outcome::ran) continue;
      keep_largest(tasks_, {trace.executor, tasks[r.job.task].name}, response_time(r));
    }
    for (const ChainRecord& c : trace.chains) {
      if (c.end_to_end_latency < Duration::zero()) continue;  // unknown
      keep_largest(chains_, {trace.executor, run.chains()[c.chain]}, c.end_to_end_latency);
    }
  }
}

std::optional<Duration> Observed::task(const std::string& executor, const std::string& name) const {
  return find(tasks_, {executor, name});
}

std::optional<Duration> Observed::chain(const std::string& executor, const std::string& name) const {
  return find(chains_, {executor, name});
}

}  // namespace hotpath
