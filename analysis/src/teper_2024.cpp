// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/teper_2024.hpp"

#include <algorithm>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply, exact::subtract;

constexpr std::string_view kMethod = "the default executor's bound (teper_2024)";

/// Sums over the callbacks of each executor, with communication where publishing is synchronous.
class Workload {
 public:
  explicit Workload(const ExecutorCallbacks& callbacks) {
    const std::size_t n = callbacks.size();
    cost_.resize(n);
    higher_.resize(n);
    std::uint32_t executors = 0;
    for (const ExecutorCallback& c : callbacks) executors = std::max(executors, c.executor);
    all_.resize(std::size_t{executors} + 1, 0);
    executor_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const ExecutorCallback& c = callbacks[i];
      cost_[i] = c.wcet;
      if (!c.asynchronous) {
        for (const DdsDelivery& d : c.deliveries) cost_[i] = add(cost_[i], d.latency);
      }
      executor_[i] = c.executor;
      higher_[i] = all_[c.executor];
      all_[c.executor] = add(all_[c.executor], cost_[i]);
    }
  }
  std::int64_t cost(std::size_t i) const { return cost_[i]; }
  std::int64_t higher(std::size_t i) const { return higher_[i]; }
  std::int64_t all(std::size_t i) const { return all_[executor_[i]]; }
  std::int64_t lower(std::size_t i) const { return all(i) - higher(i) - cost(i); }

 private:
  std::vector<std::int64_t> cost_, higher_, all_;
  std::vector<std::uint32_t> executor_;
};

std::int64_t until_start(const ExecutorCallbacks& callbacks, const Workload& work, const TaskChain& chain,
                         std::size_t position) {
  const std::size_t i = chain[position];
  const ExecutorCallback& c = callbacks[i];
  const bool has_local_predecessor = position > 0 && callbacks[chain[position - 1]].executor == c.executor;
  if (c.kind == TaskKind::timer && c.period > 0) {  // Lemma VI.2
    return add(work.all(i), std::max<std::int64_t>(0, add(subtract(c.period, work.cost(i)), work.higher(i))));
  }
  if (c.kind == TaskKind::timer) {  // Lemma VI.3
    if (!has_local_predecessor) return work.all(i);
    const std::size_t p = chain[position - 1];
    if (p < i) return work.higher(i) - work.higher(p) - work.cost(p);
    return add(work.lower(p), work.higher(i));
  }
  if (has_local_predecessor) {  // Lemma VI.5
    return add(work.lower(chain[position - 1]), work.higher(i));
  }
  return add(multiply(c.depth, work.all(i)),  // Lemma VI.4
             std::max<std::int64_t>(0, work.higher(i) - work.cost(i)));
}

/// Lemma VI.1
std::int64_t until_finish(const ExecutorCallbacks& callbacks, const Workload& work, const TaskChain& chain,
                          std::size_t position) {
  const std::size_t i = chain[position];
  std::int64_t finish = work.cost(i);
  if (callbacks[i].asynchronous && position + 1 < chain.size()) {
    for (const DdsDelivery& d : callbacks[i].deliveries) {
      if (d.to == chain[position + 1]) finish = add(finish, d.latency);
    }
  }
  return finish;
}

}  // namespace

std::int64_t ElementBound::total() const { return add(until_start, until_finish); }

std::vector<ElementBound> teper_2024_elements(const ExecutorCallbacks& callbacks, const TaskChain& chain) {
  check_callbacks(callbacks, chain, kMethod);
  if (chain.empty())
    throw AnalysisError(std::string(kMethod) + ": the chain is empty; name at least one callback");
  const Workload work(callbacks);
  std::vector<ElementBound> elements;
  for (std::size_t position = 0; position < chain.size(); ++position) {
    elements.push_back(
        {until_start(callbacks, work, chain, position), until_finish(callbacks, work, chain, position)});
  }
  return elements;
}

std::int64_t teper_2024(const ExecutorCallbacks& callbacks, const TaskChain& chain) {
  std::int64_t sum = 0;
  for (const ElementBound& e : teper_2024_elements(callbacks, chain)) sum = add(sum, e.total());
  return sum;
}

std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks) {
  check_tasks(tasks, {.method = kMethod, .instead = "", .jitter = false});
  std::int64_t all = 0, higher = 0;
  for (const PeriodicTask& t : tasks) all = add(all, t.wcet);
  std::vector<std::int64_t> bounds;
  bounds.reserve(tasks.size());
  for (const PeriodicTask& t : tasks) {
    const std::int64_t start = add(all, std::max<std::int64_t>(0, add(subtract(t.period, t.wcet), higher)));
    bounds.push_back(add(start, t.wcet));
    higher += t.wcet;  // at most `all`
  }
  return bounds;
}

std::vector<std::int64_t> teper_2024_response_times(const ExecutorCallbacks& callbacks) {
  check_callbacks(callbacks, {}, kMethod);
  const Workload work(callbacks);
  std::vector<std::int64_t> bounds;
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    if (callbacks[i].kind == TaskKind::timer) {
      bounds.push_back(add(work.all(i), std::max(work.higher(i), work.cost(i))));
    } else {
      const std::int64_t start = add(multiply(callbacks[i].depth, work.all(i)),
                                     std::max<std::int64_t>(0, work.higher(i) - work.cost(i)));
      bounds.push_back(add(start, work.cost(i)));
    }
  }
  return bounds;
}

}  // namespace hotpath
