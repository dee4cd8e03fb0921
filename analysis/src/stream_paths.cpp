// SPDX-License-Identifier: Apache-2.0
#include "stream_paths.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "hotpath/analysis/exact.hpp"
#include "processor_windows.hpp"

namespace hotpath {

namespace {

using exact::add, exact::subtract;
using Bound = std::optional<std::int64_t>;

constexpr std::size_t kMostStreams = 256;  // of one publisher
constexpr int kMostRounds = 1000, kMostRoundsBesideOthers = 50;
constexpr std::int64_t kLongestSearch = std::int64_t{1} << 50;  // 13 days

class StreamPaths final : public PathBounds {
 public:
  StreamPaths(StreamedSystem system, const PathBounds* others)
      : system_(std::move(system)), others_(others), topology_(system_.graph), set_(system_.graph.set) {
    const auto elsewhere = [this](TaskId publisher, TaskId fed) { return comes_as_stream(publisher, fed); };
    for (const auto& [number, processor] : system_.processors) {
      processors_[number] =
          std::make_unique<ProcessorWindows>(system_.graph, processor.here, elsewhere, processor.order,
                                             processor.overheads, streams_to(processor.here));
    }
    settle();
  }

  Bound until_start(TaskId root, TaskId to) const override { return longest(root, to, false); }

  Bound until_finish(TaskId root, TaskId to) const override { return longest(root, to, true); }

  Bound start_to_start(TaskId root, TaskId to) const override {
    if (root == to) return 0;
    if (on_one_processor(root, to)) return windows_of(root).start_to_start(root, to);
    Bound finish = until_finish(root, to), along = along_hops(root, to);
    if (finish) *finish = subtract(*finish, set_[to].bcet.count());
    // A job starts at the latest its longest execution time before the bound on its end, since a window
    // bounds the time of the decision.
    if (along) *along = subtract(*along, set_[to].wcet.count());
    return smaller(finish, along);
  }

  Bound start_to_finish(TaskId root, TaskId to) const override {
    if (on_one_processor(root, to)) return windows_of(root).start_to_finish(root, to);
    return smaller(until_finish(root, to), along_hops(root, to));
  }

  std::int64_t lateness() const override { return others_ != nullptr ? others_->lateness() : 0; }

  Bound response(TaskId subscription) const override {
    if (!system_.bounded[subscription]) return std::nullopt;
    Bound largest = 0;
    for (const TaskId p : topology_.publishers(subscription)) {
      for (const TaskId root : topology_.roots(p)) {
        const Bound finish = until_finish(root, subscription), start = until_start(root, subscription);
        if (!finish || !start) largest = std::nullopt;
        if (largest) largest = std::max(*largest, subtract(std::max(*start, *finish), least_end(root, p)));
      }
    }
    Bound window = windows_of(subscription).longest_window(subscription);
    if (window) *window = add(*window, late());
    const Bound here = smaller(largest, window);
    return others_ != nullptr ? smaller(here, others_->response(subscription)) : here;
  }

  PathParts parts(TaskId root, TaskId to) const override {
    PathParts parts;
    Bound most;
    for_each_way(root, to, [&](TaskId timer, TaskId publisher, const SampleStream* stream) {
      const Bound way = until(root, to, timer, publisher, stream, true);
      if (!way || (most && *way <= *most)) return;
      most = way;
      parts = windows_of(to).parts(timer, to);
      if (publisher != kNoTask) parts.work.emplace_back(publisher, *latest_end(root, publisher));
    });
    const Bound others = others_ != nullptr ? others_->until_finish(root, to) : std::nullopt;
    if (others && (!most || *others < *most)) return others_->parts(root, to);
    std::ranges::stable_sort(parts.work, std::greater<>(), [](const auto& part) { return part.second; });
    return parts;
  }

 private:
  const GraphBusyWindow& windows_of(TaskId id) const {
    return processors_.at(system_.processor_of[id])->windows();
  }

  /// How much later than its publication a thread may see a sample of a stream.
  std::int64_t late() const { return add(system_.wake_up, system_.delivery); }

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
    const bool other_thread = system_.wake_up > 0 && system_.thread_of[publisher] != system_.thread_of[fed];
    return system_.delivery > 0 || other_thread ||
           system_.processor_of[publisher] != system_.processor_of[fed];
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
    return jitter ? Bound(add(*jitter, late())) : std::nullopt;
  }

  void set_jitters() {
    for (const auto& [number, processor] : processors_) {
      std::vector<std::int64_t> jitter;
      for (const SampleStream& stream : processor->streams()) {
        jitter.push_back(jitter_of(stream).value_or(GraphOrder::kUnbounded));
      }
      processor->set_jitter(jitter, 2 * system_.wake_up);  // of the timer thread, and of the executor's
    }
    known_.clear();
  }

  /// Raises the latest ends to those of all processors' windows. Returns whether any has changed.
  bool raise_ends() {
    bool changed = false;
    std::map<std::pair<TaskId, TaskId>, Bound> next = ends_;
    for (auto& [way, end] : next) {
      const Bound finish = until_finish(way.first, way.second), start = until_start(way.first, way.second);
      Bound latest = finish && start ? Bound(std::max(*finish, *start)) : std::nullopt;
      if (latest && *latest > kLongestSearch) latest = std::nullopt;
      if (!end || (latest && *latest <= *end)) continue;
      end = latest;
      changed = true;
    }
    ends_ = std::move(next);
    return changed;
  }

  /// Raises the latest ends until all processors' windows agree with them; if they do not, the other bounds
  /// hold.
  void settle() {
    for (int round = 0; round < (others_ != nullptr ? kMostRoundsBesideOthers : kMostRounds); ++round) {
      set_jitters();
      if (!raise_ends()) return;
    }
    if (others_ == nullptr)
      throw AnalysisError("the latencies of jobs that activate each other have no fixed point");
    for (auto& [way, end] : ends_) {
      const Bound finish = others_->until_finish(way.first, way.second),
                  start = others_->until_start(way.first, way.second);
      end = finish && start ? Bound(std::max(*finish, *start)) : std::nullopt;
    }
    set_jitters();
  }

  /// Calls `way(timer, publisher, stream)` for each way from `root` to `to`, by the stream with which it
  /// comes to the processor of `to`; kNoTask and nullptr: `root` is on this processor.
  template <class Way>
  void for_each_way(TaskId root, TaskId to, Way way) const {
    const ProcessorWindows& here = *processors_.at(system_.processor_of[to]);
    if (system_.processor_of[root] == system_.processor_of[to] && here.leads_to(root, to)) {
      way(root, kNoTask, nullptr);
    }
    for (std::size_t s = 0; s < here.streams().size(); ++s) {
      const SampleStream& stream = here.streams()[s];
      if (!here.leads_to(here.timer(s), to) || (stream.of_root() && stream.root != root)) continue;
      for (const TaskId p : together(stream.publisher)) {
        if (topology_.leads_to(root, p)) way(here.timer(s), p, &stream);
      }
    }
  }

  /// From a timestamp of `root` to the end, or the start, of the resulting job of `to`, on one way of
  /// for_each_way().
  Bound until(TaskId root, TaskId to, TaskId timer, TaskId publisher, const SampleStream* stream,
              bool works) const {
    const GraphBusyWindow& windows = windows_of(to);
    if (stream != nullptr && !latest_end(root, publisher)) return std::nullopt;
    const bool since_arrival = stream != nullptr && !stream->of_root();
    const Bound behind = since_arrival ? windows.since_arrival(timer, to, works)
                         : works       ? windows.until_finish(timer, to)
                                       : windows.until_start(timer, to);
    if (!behind || stream == nullptr) return behind;
    const std::int64_t before =
        since_arrival ? add(*latest_end(root, publisher), late()) : least_end(root, publisher);
    return add(before, *behind);
  }

  Bound longest(TaskId root, TaskId to, bool works) const {
    works = works || topology_.join_of(to) == nullptr;
    const auto [entry, is_new] = known_.try_emplace({root, to, works});
    if (!is_new || !system_.bounded[to]) return entry->second;
    Bound most;
    bool bounded = true;
    for_each_way(root, to, [&](TaskId timer, TaskId publisher, const SampleStream* stream) {
      const Bound way = until(root, to, timer, publisher, stream, works);
      bounded = bounded && way;
      most = std::max(most, way);
    });
    if (!bounded) most = std::nullopt;
    if (others_ != nullptr)
      most = smaller(most, works ? others_->until_finish(root, to) : others_->until_start(root, to));
    return entry->second = most;
  }

  /// From the start of a job of `root` to the end of the resulting job of `to`, if all samples come as
  /// streams: the sum over the hops, each from the arrival of its sample on.
  Bound along_hops(TaskId root, TaskId to) const {
    if (system_.delivery == 0 || !system_.bounded[root] || !system_.bounded[to]) return std::nullopt;
    const auto [entry, is_new] = along_hops_.try_emplace({root, to});
    if (!is_new) return entry->second;
    if (root == to) return entry->second = windows_of(root).start_to_finish(root, root);
    Bound most = 0;
    for_each_way(root, to, [&](TaskId timer, TaskId publisher, const SampleStream*) {
      const Bound before = along_hops(root, publisher);
      const Bound behind = before && most ? windows_of(to).since_arrival(timer, to, true) : std::nullopt;
      most = behind ? std::max(most, Bound(add(add(*before, late()), *behind))) : std::nullopt;
    });
    return entry->second = most;
  }

  bool on_one_processor(TaskId root, TaskId to) const {
    bool stays = system_.bounded[to];
    if (!stays) return false;
    for_each_way(root, to, [&](TaskId timer, TaskId publisher, const SampleStream* stream) {
      stays = stays && stream == nullptr && until(root, to, timer, publisher, stream, true);
    });
    return stays;
  }

  const StreamedSystem system_;
  const PathBounds* const others_;
  const GraphTopology topology_;
  const TaskSet& set_;
  std::map<std::uint32_t, std::unique_ptr<ProcessorWindows>> processors_;
  /// By root and task, of those that publish late samples or from whose join such samples come.
  std::map<std::pair<TaskId, TaskId>, Bound> ends_;
  mutable std::map<std::tuple<TaskId, TaskId, bool>, Bound> known_;
  mutable std::map<std::pair<TaskId, TaskId>, Bound> along_hops_;
};

}  // namespace

std::unique_ptr<PathBounds> stream_paths(StreamedSystem system, const PathBounds* others) {
  return std::make_unique<StreamPaths>(std::move(system), others);
}

}  // namespace hotpath
