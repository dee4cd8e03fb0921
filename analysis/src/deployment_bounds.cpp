// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/deployment_bounds.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "deployment_model.hpp"
#include "hotpath/analysis/exact.hpp"
#include "processor_windows.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using exact::add, exact::subtract;
using Bound = std::optional<std::int64_t>;

constexpr std::uint32_t kNowhere = ~0U;
constexpr std::size_t kMostStreams = 256;  // of one publisher
constexpr int kMostRounds = 1000;
constexpr std::int64_t kLongest = std::int64_t{1} << 50;  // 13 days

/// Bounds along paths over all processors. The latest ends of the jobs that publish to other processors are
/// the least fixed point of all processors' busy windows.
class DeploymentPaths final : public PathBounds {
 public:
  explicit DeploymentPaths(const DeployedSystem& system)
      : graph_(with_joins_of_one_thread(system)),
        topology_(graph_),
        set_(graph_.set),
        processor_of_(set_.size(), kNowhere),
        thread_of_(system.thread_of),
        wake_up_(system.platform.wake_up_latency.count()) {
    std::set<unsigned> processors;
    for (TaskId id = 0; id < set_.size(); ++id) {
      const DeployedThread& thread = system.threads[system.thread_of[id]];
      bounded_.push_back(thread.priority > 0);
      if (thread.processors.size() != 1) continue;
      processor_of_[id] = thread.processors.front();
      if (thread.priority > 0) processors.insert(thread.processors.front());
    }
    for (const unsigned processor : processors) {
      std::vector<bool> here(set_.size());
      for (TaskId id = 0; id < set_.size(); ++id) here[id] = processor_of_[id] == processor;
      const auto elsewhere = [this](TaskId publisher, TaskId fed) { return comes_as_stream(publisher, fed); };
      processors_[processor] = std::make_unique<ProcessorWindows>(
          graph_, here, elsewhere, order_on(system, here), overheads_on(system, here), streams_to(here));
    }
    settle();
  }

  Bound until_start(TaskId root, TaskId to) const override { return longest(root, to, false); }
  Bound until_finish(TaskId root, TaskId to) const override { return longest(root, to, true); }

  Bound start_to_start(TaskId root, TaskId to) const override {
    if (root == to) return 0;
    if (on_one_processor(root, to)) return windows_of(root).start_to_start(root, to);
    const Bound finish = until_finish(root, to);
    return finish ? Bound(subtract(*finish, set_[to].bcet.count())) : std::nullopt;
  }
  Bound start_to_finish(TaskId root, TaskId to) const override {
    return on_one_processor(root, to) ? windows_of(root).start_to_finish(root, to) : until_finish(root, to);
  }
  Bound later_start_to_start(TaskId, TaskId, TaskId, TaskId, TaskId) const override { return std::nullopt; }
  bool overtakes(TaskId, TaskId) const override { return false; }
  Bound precedence(TaskId, TaskId, TaskId) const override { return std::nullopt; }
  std::int64_t lateness() const override { return 0; }

  Bound response(TaskId subscription) const override {
    if (!bounded_[subscription]) return std::nullopt;
    Bound largest = 0;
    for (const TaskId p : topology_.publishers(subscription)) {
      for (const TaskId root : topology_.roots(p)) {
        const Bound finish = until_finish(root, subscription), start = until_start(root, subscription);
        if (!finish || !start) largest = std::nullopt;
        if (largest) largest = std::max(*largest, subtract(std::max(*start, *finish), least_end(root, p)));
      }
    }
    Bound window = windows_of(subscription).longest_window(subscription);
    if (window) *window = add(*window, wake_up_);
    return largest && window ? std::min(*largest, *window) : largest ? largest : window;
  }

  PathParts parts(TaskId root, TaskId to) const override {
    PathParts parts;
    Bound most;
    for_each_way(root, to, true, [&](TaskId timer, TaskId publisher, Bound way) {
      if (!way || (most && *way <= *most)) return;
      most = way;
      parts = windows_of(to).parts(timer, to);
      if (publisher != kNoTask) parts.work.emplace_back(publisher, *latest_end(root, publisher));
    });
    std::ranges::stable_sort(parts.work, std::greater<>(), [](const auto& part) { return part.second; });
    return parts;
  }

 private:
  const GraphBusyWindow& windows_of(TaskId id) const { return processors_.at(processor_of_[id])->windows(); }

  std::int64_t least_end(TaskId root, TaskId id) const {
    return add(topology_.least_until_start(root, id), set_[id].bcet.count());
  }

  /// The tasks that publish together with `id`.
  std::vector<TaskId> together(TaskId id) const {
    const auto* join = topology_.join_of(id);
    return join ? join->inputs : std::vector<TaskId>{id};
  }

  /// The outputs of `publisher`, one stream for each way from a timer, or from the join that they come from.
  std::vector<SampleStream> outputs(TaskId publisher) const {
    const auto* join = topology_.join_of(publisher);
    if (join == nullptr) return jobs(publisher);
    std::vector<SampleStream> fewest;
    double least = std::numeric_limits<double>::infinity();
    for (const TaskId input : join->inputs) {
      std::vector<SampleStream> all = jobs(input);
      double rate = 0;
      for (SampleStream& stream : all) {
        rate += 1.0 / static_cast<double>(set_[stream.root].period.count());
        stream.inputs.push_back(input);
      }
      if (rate < least) fewest = std::move(all), least = rate;
    }
    return fewest;
  }

  /// The activations of `id`.
  std::vector<SampleStream> jobs(TaskId id) const {
    std::vector<SampleStream> all;
    if (set_[id].kind == TaskKind::timer) all.push_back({kNoTask, id});
    for (const TaskId p : topology_.publishers(id)) {
      if (together(p).front() != p) continue;
      const std::vector<SampleStream> some = outputs(p);
      all.insert(all.end(), some.begin(), some.end());
    }
    if (all.size() > kMostStreams) {
      throw AnalysisError("more than " + std::to_string(kMostStreams) + " ways lead to " + set_[id].name);
    }
    return all;
  }

  /// Samples from another processor, and, where a sleeping thread must wake up first, from another thread.
  bool comes_as_stream(TaskId publisher, TaskId fed) const {
    const bool other_thread = wake_up_ > 0 && thread_of_[publisher] != thread_of_[fed];
    return processor_of_[publisher] != processor_of_[fed] || other_thread;
  }

  std::vector<SampleStream> streams_to(const std::vector<bool>& here) {
    std::vector<SampleStream> all;
    for (TaskId p = 0; p < set_.size(); ++p) {
      const auto comes = [&](TaskId fed) { return here[fed] && comes_as_stream(p, fed); };
      if (together(p).front() != p || !std::ranges::any_of(set_[p].feeds, comes)) continue;
      for (SampleStream& stream : outputs(p)) {
        stream.publisher = p;
        all.push_back(stream);
        need(together(p));
        for (const TaskId input : stream.inputs) need(together(input));
      }
    }
    return all;
  }

  void need(const std::vector<TaskId>& tasks) {
    for (const TaskId id : tasks) {
      for (const TaskId root : topology_.roots(id)) ends_.try_emplace({root, id}, least_end(root, id));
    }
  }

  /// The latest end of the job of `id` that a job of `root` leads to; it is one of those in ends_.
  Bound latest_end(TaskId root, TaskId id) const { return ends_.at({root, id}); }

  Bound jitter_at(TaskId root, TaskId id) const {
    const Bound latest = latest_end(root, id);
    return latest ? Bound(subtract(*latest, least_end(root, id))) : std::nullopt;
  }

  /// The longest time from an output of the join of `input` to a publication of `publisher`.
  Bound hop(TaskId input, TaskId publisher) const {
    if (topology_.join_of(input) == topology_.join_of(publisher)) return 0;
    std::int64_t longest = 0;
    for (const TaskId from : together(input)) {
      for (const TaskId root : topology_.roots(from)) {
        for (const TaskId p : together(publisher)) {
          if (!topology_.leads_to(root, p)) continue;
          const Bound latest = latest_end(root, p);
          if (!latest) return std::nullopt;
          longest = std::max(longest, subtract(*latest, least_end(root, from)));
        }
      }
    }
    return longest;
  }

  /// How late the samples of a stream may come. Between two outputs of a join lies another sample of the
  /// input, which the first of them may have taken up to a period late.
  Bound jitter_of(const SampleStream& stream) const {
    Bound jitter = jitter_at(stream.root, stream.of_root() ? stream.publisher : stream.inputs.front());
    for (std::size_t i = 0; i < stream.inputs.size() && jitter; ++i) {
      const TaskId next = i + 1 < stream.inputs.size() ? stream.inputs[i + 1] : stream.publisher;
      const Bound way = hop(stream.inputs[i], next);
      if (!way) return std::nullopt;
      jitter = add(*jitter, add(set_[stream.root].period.count(), *way));
    }
    return jitter ? Bound(add(*jitter, wake_up_)) : std::nullopt;
  }

  void set_jitters() {
    for (const auto& [number, processor] : processors_) {
      std::vector<std::int64_t> jitter;
      for (const SampleStream& stream : processor->streams()) {
        jitter.push_back(jitter_of(stream).value_or(GraphOrder::kUnbounded));
      }
      processor->set_jitter(jitter, 2 * wake_up_);  // of the timer thread, and of the executor's
    }
    known_.clear();
  }

  /// Raises the latest ends until all processors' windows agree with them.
  void settle() {
    for (int round = 0; round < kMostRounds; ++round) {
      set_jitters();
      bool changed = false;
      std::map<std::pair<TaskId, TaskId>, Bound> next = ends_;
      for (auto& [way, end] : next) {
        const Bound finish = until_finish(way.first, way.second), start = until_start(way.first, way.second);
        Bound latest = finish && start ? Bound(std::max(*finish, *start)) : std::nullopt;
        if (latest && *latest > kLongest) latest = std::nullopt;
        if (!end || (latest && *latest <= *end)) continue;
        end = latest;
        changed = true;
      }
      ends_ = std::move(next);
      if (!changed) return;
    }
    throw AnalysisError("the latencies of processors that activate each other have no fixed point");
  }

  /// Calls `way(timer, publisher, bound)` for each way from `root` to `to`, by the sample with which it comes
  /// to the processor of `to`; kNoTask: `root` is on this processor.
  template <class Way>
  void for_each_way(TaskId root, TaskId to, bool works, Way way) const {
    if (!bounded_[to]) return way(root, kNoTask, std::nullopt);
    const ProcessorWindows& here = *processors_.at(processor_of_[to]);
    const GraphBusyWindow& windows = here.windows();
    if (processor_of_[root] == processor_of_[to] && here.leads_to(root, to)) {
      way(root, kNoTask, works ? windows.until_finish(root, to) : windows.until_start(root, to));
    }
    for (std::size_t s = 0; s < here.streams().size(); ++s) {
      const SampleStream& stream = here.streams()[s];
      const TaskId timer = here.timer(s);
      if (!here.leads_to(timer, to)) continue;
      for (const TaskId p : together(stream.publisher)) {
        if (!topology_.leads_to(root, p)) continue;
        if (stream.of_root() && stream.root != root) continue;
        const Bound latest = latest_end(root, p);
        const Bound behind = !stream.of_root() ? windows.since_arrival(timer, to, works)
                             : works           ? windows.until_finish(timer, to)
                                               : windows.until_start(timer, to);
        if (!latest || !behind) {
          way(timer, p, std::nullopt);
          continue;
        }
        const std::int64_t before = stream.of_root() ? least_end(root, p) : add(*latest, wake_up_);
        way(timer, p, add(before, *behind));
      }
    }
  }

  Bound longest(TaskId root, TaskId to, bool works) const {
    const auto [entry, is_new] = known_.try_emplace({root, to, works});
    if (!is_new) return entry->second;
    Bound most;
    bool any = false, bounded = true;
    for_each_way(root, to, works, [&](TaskId, TaskId, Bound way) {
      any = true;
      bounded = bounded && way.has_value();
      if (way && (!most || *way > *most)) most = way;
    });
    return entry->second = any && bounded ? most : std::nullopt;
  }

  bool on_one_processor(TaskId root, TaskId to) const {
    bool stays = true;
    for_each_way(root, to, true,
                 [&](TaskId, TaskId publisher, Bound way) { stays = stays && publisher == kNoTask && way; });
    return stays;
  }

  const CallbackGraph graph_;
  const GraphTopology topology_;
  const TaskSet& set_;
  std::vector<std::uint32_t> processor_of_;  // by task; kNowhere: several, in the ordinary scheduling class
  const std::vector<std::uint32_t> thread_of_;
  const std::int64_t wake_up_;
  std::vector<bool> bounded_;  // by task: not of that class
  std::map<unsigned, std::unique_ptr<ProcessorWindows>> processors_;
  /// By root and task, of those that publish to other processors or from whose join such samples come.
  std::map<std::pair<TaskId, TaskId>, Bound> ends_;
  mutable std::map<std::tuple<TaskId, TaskId, bool>, Bound> known_;
};

/// Names the executor that leaves a chain without a bound, if one does.
void explain_missing(const DeployedSystem& system, const GraphTopology& topology, GraphBounds& out) {
  for (std::size_t c = 0; c < out.chains.size(); ++c) {
    if (out.chains[c]) continue;
    std::vector<TaskId> upstream = system.graph.chains[c].sinks;
    for (std::size_t i = 0; i < upstream.size(); ++i) {
      const DeployedThread& thread = system.threads[system.thread_of[upstream[i]]];
      if (thread.priority == 0) {
        out.no_chain_bound[c] = system.graph.set[upstream[i]].name + " runs in executor " + thread.name +
                                ", whose thread is of the ordinary scheduling class";
        break;
      }
      for (const TaskId p : topology.publishers(upstream[i])) {
        if (std::ranges::find(upstream, p) == upstream.end()) upstream.push_back(p);
      }
      for (const TaskId read : system.graph.reads[upstream[i]]) {
        if (std::ranges::find(upstream, read) == upstream.end()) upstream.push_back(read);
      }
    }
  }
}

}  // namespace

GraphBounds deployment_bounds(const DeployedSystem& system) {
  constexpr const char* kMethod = "busy windows of each processor";
  if (auto refusal = refusal_of(system)) return {.method = kMethod, .refusal = std::move(refusal)};
  return attempt(kMethod, 0, [&](GraphBounds& bounds) {
    const GraphTopology topology(system.graph);
    bound_graph(topology, DeploymentPaths(system), bounds);
    explain_missing(system, topology, bounds);
  });
}

}  // namespace hotpath
