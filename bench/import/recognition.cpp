// SPDX-License-Identifier: Apache-2.0
#include "import/recognition.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "hotpath/core/platform.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using Of = Agreement::Of;

/// With fewer contested decisions a recording recognises nothing.
constexpr std::size_t kFewest = 20;
/// A smaller share of agreeing decisions is no explanation.
constexpr double kFits = 0.8;
/// Limits of the share of decisions that noise is taken to change.
constexpr double kLeastNoise = 0.02, kMostNoise = 0.3;
/// A hypothesis is excluded if the best one is a thousand times as likely, and the decisions that tell them
/// apart exceed their standard deviation by this factor and are of so many kinds.
const double kDecisive = std::log(1000);
constexpr double kDeviations = 2.5;
constexpr std::size_t kKinds = 2;
/// Decisions of one kind suffice if there are so many that timing cannot explain, and if the best
/// hypothesis has the agreement kExact.
constexpr std::size_t kPlain = 20;
/// A trace does not show when a thread that polls a shared wait set noticed a ready entity: such executors
/// are not distinguished from each other, and from others only by a difference in agreement above kUnseen;
/// executors that release timers only if no hypothesis has the agreement kExact.
constexpr double kUnseen = 0.1, kExact = 0.97;
/// A fitted order must remove this share of the contradictions, and as many.
constexpr double kBetter = 0.1;
constexpr std::size_t kFewer = 3;
/// Evidence for the order of two tasks that counts.
constexpr std::int64_t kEvidence = 2;

/// A recording does not show when threads that share a wait set poll it.
bool shares_waits(const Hypothesis& hypothesis) {
  const ExecutorTraits& traits = hypothesis.entry->traits;
  return traits.timers == TimerHandling::polled && traits.many_workers;
}

/// Whether a recording does not show when the executor notices what is ready: when threads that
/// share a wait set poll it, or when the thread that releases timers runs.
bool notices_unseen(const Hypothesis& hypothesis, double best) {
  const ExecutorTraits& traits = hypothesis.entry->traits;
  const bool releases = traits.timers != TimerHandling::polled && !traits.raises_timer_thread;
  return shares_waits(hypothesis) || (releases && best < kExact);
}

/// What a hypothesis may choose besides the order, or chose to fit the recording, and how unusual it is.
int open_choices(const Hypothesis& hypothesis) {
  const ExecutorTraits& traits = hypothesis.entry->traits;
  const int variants = static_cast<int>(hypothesis.options.rule != SubscriptionRule::inherit) +
                       static_cast<int>(hypothesis.options.ties != Ties::lifo) +
                       static_cast<int>(hypothesis.superseded) +
                       static_cast<int>(hypothesis.release_delay > Duration::zero());
  return variants + (traits.policy == Policy::fp ? 4 : 0) + (traits.policy == Policy::dm ? 8 : 0) +
         (traits.on_rclcpp ? 0 : 16);
}

/// The hypothesis with what a recording does not show about its threads.
std::vector<Hypothesis> open_variants(const Hypothesis& hypothesis) {
  const ExecutorTraits& traits = hypothesis.entry->traits;
  const bool releases =
      traits.timers == TimerHandling::release_only || traits.timers == TimerHandling::marked_ready;
  std::vector<Hypothesis> variants;
  if (shares_waits(hypothesis)) variants.emplace_back(hypothesis).asks_in_vain = true;
  if (releases && !traits.raises_timer_thread)
    for (const Duration delay : {Platform{}.time_slice, kUntilIdle})
      variants.emplace_back(hypothesis).release_delay = delay;
  return variants;
}

bool is_leading(const Score& score, const Score& best) {
  if (shares_waits(score.hypothesis) && shares_waits(best.hypothesis)) return true;
  if (notices_unseen(score.hypothesis, best.agreement) && best.agreement - score.agreement < kUnseen)
    return true;
  const bool plain = !shares_waits(score.hypothesis) && best.agreement >= kExact &&
                     score.plain_against >= kPlain + 2 * score.plain_in_favour;
  return score.margin < kDecisive || (score.kinds_against < kKinds && !plain) ||
         score.difference() < kDeviations * std::sqrt(static_cast<double>(score.differing()));
}

Verdict verdict_of(const Recognition& r) {
  const auto leaders = std::span(r.ranking).first(r.leading);
  if (leaders.empty() || (leaders.front().agreement < kFits && r.contested >= kFewest))
    return Verdict::none_fits;
  const ExecutorTraits& first = leaders.front().hypothesis.entry->traits;
  // Events of waits prove more than decisions do.
  if (r.ranking.size() == 1 && emits_waits(first)) return Verdict::recognised;
  // What the decisions make unlikely does not hide that all others are of one design.
  const bool same = std::ranges::all_of(leaders, [&](const Score& s) {
    const ExecutorTraits& traits = s.hypothesis.entry->traits;
    return s.unlikely || s.differing() == 0 ||
           (traits.family == first.family && traits.timers == first.timers);
  });
  const bool few = 2 * leaders.size() <= r.ranking.size();
  if (r.contested < kFewest || (!same && !few)) return Verdict::undecided;
  return leaders.size() == 1 ? Verdict::recognised : Verdict::tie;
}

/// The tasks of `graph` in the order that they have in a graph of that order.
std::vector<TaskId> tasks_in(const ServiceOrder& order, const tracing::System& system,
                             const RecordedGraph& graph) {
  std::vector<TaskId> tasks;
  for (const std::uint32_t node : order.nodes)
    for (const std::uint32_t c : order.callbacks)
      if (system.callbacks[c].node == node) tasks.push_back(graph.task_of[c]);
  for (TaskId id = 0; id < graph.callback_of.size(); ++id)
    if (graph.callback_of[id] == kNone) tasks.push_back(id);
  return tasks;
}

class Recogniser {
 public:
  Recogniser(const tracing::System& system, const RecordedGraph& graph, const RecordedSteps& steps)
      : system_(system), graph_(graph), set_(graph.tasks.set), steps_(steps), half_(steps.starts / 2) {
    for (const RecordedStep& step : steps.steps)
      if (step.kind == RecordedStep::Kind::start) starts_.push_back(&step);
    for (std::size_t d = half_; d < starts_.size(); ++d) contested_ += starts_[d]->contested;
  }

  Recognition recognise(const std::vector<Hypothesis>& possible, const std::string& stated) {
    bool fitted_levels = false;
    for (const Hypothesis& hypothesis : possible) {
      Score best = fit_order(hypothesis);
      for (const Hypothesis& open : open_variants(hypothesis)) {
        Score other = fit_order(open);
        if (other.contradictions < best.contradictions) best = std::move(other);
      }
      if (hypothesis.needs_levels() && hypothesis.levels.empty()) {
        fit_levels(set_, steps_, best.hypothesis, half_);
        fitted_levels = true;
      }
      all_.push_back(judged(std::move(best)));
    }
    if (fitted_levels) share_levels();
    Recognition result;
    result.stated = stated;
    result.decisions = starts_.size() - half_;
    result.contested = contested_;
    if (!all_.empty()) rank(result);
    result.ranking = std::move(all_);
    result.verdict = stated.empty() ? verdict_of(result) : Verdict::recognised;
    return result;
  }

 private:
  /// A fitted hypothesis, which follows the second half of the decisions.
  Score judged(Score score) const {
    score.followed = follow(set_, steps_, score.hypothesis, half_, steps_.starts);
    score.contradictions = score.followed.contradictions;
    const double contested = static_cast<double>(std::max<std::size_t>(1, contested_));
    score.agreement = std::max(0.0, 1 - static_cast<double>(score.contradictions) / contested);
    return score;
  }

  Agreement first_half(const Hypothesis& hypothesis) const {
    return follow(set_, steps_, hypothesis, 0, half_);
  }

  /// The search for levels ends at a local optimum. So each hypothesis also tries the levels that were
  /// found for the others, on the first half.
  void share_levels() {
    std::set<std::vector<std::int64_t>> found;
    for (const Score& s : all_)
      if (s.hypothesis.needs_levels()) found.insert(s.hypothesis.levels);
    for (Score& s : all_) {
      if (!s.hypothesis.needs_levels()) continue;
      std::size_t least = first_half(s.hypothesis).contradictions;
      Score best = s;
      for (const std::vector<std::int64_t>& levels : found) {
        Hypothesis other = s.hypothesis;
        other.levels = levels;
        const std::size_t contradictions = first_half(other).contradictions;
        if (contradictions < least) best.hypothesis = other;
        least = std::min(least, contradictions);
      }
      if (best.hypothesis.levels != s.hypothesis.levels) s = judged(std::move(best));
    }
  }

  /// Compares the order of creation with its reverse: where two tasks compete by that order alone,
  /// one of the two contradicts the recording. The contradictions are those of the first half.
  Score fit_order(const Hypothesis& hypothesis) const {
    Score score{.hypothesis = hypothesis};
    const Agreement forward = first_half(hypothesis);
    score.contradictions = forward.contradictions;
    std::ranges::reverse(score.hypothesis.order);
    const Agreement backward = first_half(score.hypothesis);
    score.hypothesis.order = hypothesis.order;
    OrderEvidence evidence;
    for (const auto& [pair, count] : forward.before) evidence[std::minmax(pair.first, pair.second)] -= count;
    for (const auto& [pair, count] : backward.before) evidence[std::minmax(pair.first, pair.second)] += count;
    std::erase_if(evidence, [](const auto& e) { return std::abs(e.second) < kEvidence; });
    if (std::ranges::none_of(evidence, [](const auto& e) { return e.second < 0; })) return score;
    Score fitted = score;
    fitted.hypothesis.order = tasks_in(service_order(system_, graph_, evidence), system_, graph_);
    fitted.contradictions = first_half(fitted.hypothesis).contradictions;
    fitted.evidence = std::move(evidence);
    const auto least = std::max<std::size_t>(
        kFewer, static_cast<std::size_t>(kBetter * static_cast<double>(score.contradictions)));
    return fitted.contradictions + least > score.contradictions ? score : fitted;
  }

  /// Sorts the scores by contradictions to the recording. The first one is the simplest of those
  /// that fit and that the recording does not tell apart from the best one.
  void rank(Recognition& result) {
    std::ranges::stable_sort(
        all_, {}, [](const Score& s) { return std::pair(s.contradictions, open_choices(s.hypothesis)); });
    compare_with_first();
    const auto leads = [&](const Score& s) { return is_leading(s, all_.front()); };
    const auto simplest = std::ranges::min_element(all_, {}, [&](const Score& s) {
      return leads(s) && s.agreement >= kFits ? open_choices(s.hypothesis) : 1000;
    });
    std::rotate(all_.begin(), simplest, simplest + 1);
    compare_with_first();
    const auto excluded = std::stable_partition(all_.begin(), all_.end(), leads);
    result.leading = static_cast<std::size_t>(excluded - all_.begin());
    const Score& best = all_.front();
    for (Score& s : std::span(all_).first(result.leading))
      s.unlikely = s.margin >= kDecisive && !notices_unseen(s.hypothesis, best.agreement);
    const std::vector<Of>& of_best = best.followed.decisions;
    for (std::size_t d = half_; d < of_best.size() && result.breaks.empty(); ++d)
      if (of_best[d] == Of::no)
        result.breaks = program::text("at %.1f ms, when %s ran", to_ms(starts_[d]->at - graph_.epoch),
                                      set_[starts_[d]->task].name.c_str());
  }

  void compare_with_first() {
    const Agreement& best = all_.front().followed;
    const double noise = std::clamp(1 - all_.front().agreement, kLeastNoise, kMostNoise);
    for (Score& score : all_) {
      const Agreement& other = score.followed;
      std::set<std::pair<TaskId, TaskId>> kinds;
      score.against = score.in_favour = score.plain_against = score.plain_in_favour = 0;
      for (std::size_t d = half_; d < best.decisions.size(); ++d) {
        const bool against = best.decisions[d] != Of::no && other.decisions[d] == Of::no;
        if (against) kinds.emplace(starts_[d]->task, other.preferred[d]);
        score.against += against;
        score.in_favour += best.decisions[d] == Of::no && other.decisions[d] != Of::no;
        score.plain_against += against && other.plain[d];
        score.plain_in_favour += best.plain[d] && other.decisions[d] != Of::no;
      }
      score.kinds_against = kinds.size();
      score.margin = score.difference() * std::log((1 - noise) / noise);
    }
  }

  const tracing::System& system_;
  const RecordedGraph& graph_;
  const TaskSet& set_;
  const RecordedSteps& steps_;
  const std::size_t half_;
  std::vector<const RecordedStep*> starts_;
  std::size_t contested_ = 0;  // of the judged half
  std::vector<Score> all_;
};

/// Repeatedly takes the item that the remaining items precede least; of equals the first one.
/// `ahead(a, b)`: how much more the recording says for a before b than for b before a.
template <class Ahead>
std::vector<std::uint32_t> in_order(std::vector<std::uint32_t> left, Ahead&& ahead) {
  std::vector<std::uint32_t> order;
  while (!left.empty()) {
    const auto behind = [&](std::uint32_t item) {
      std::int64_t sum = 0;
      for (const std::uint32_t other : left)
        if (other != item) sum += std::max<std::int64_t>(0, ahead(other, item));
      return sum;
    };
    const auto first = std::ranges::min_element(left, {}, behind);
    order.push_back(*first);
    left.erase(first);
  }
  return order;
}

std::string share_of(const Score& score, const Recognition& r) {
  return program::text("%.1f %% of %zu contested decisions", 100 * score.agreement, r.contested);
}

std::string next_one(const Recognition& r) {
  if (r.ranking.size() == 1) return "; no other known executor has such threads.";
  if (r.leading >= r.ranking.size()) return ".";
  const Score& next = r.ranking[r.leading];
  return program::text("; the next one, %s, explains %.1f %%.", next.hypothesis.label.c_str(),
                       100 * next.agreement);
}

std::string tie(const Recognition& r) {
  const std::vector<std::string> unlikely = r.names(true);
  std::vector<std::string> likely = r.names();
  std::erase_if(likely, [&](const std::string& name) { return std::ranges::count(unlikely, name) > 0; });
  std::string all = program::concat(
      program::joined(likely, ", "),
      likely.size() == 1 ? " explains the recording best, " : " explain the recording equally well, ",
      share_of(r.ranking.front(), r));
  if (!unlikely.empty())
    all += program::concat("; ", program::joined(unlikely, ", "), " cannot be excluded, but ",
                           unlikely.size() == 1 ? "makes" : "make",
                           " the recording a thousand times less likely");
  return all + next_one(r);
}

std::string undecided(const Recognition& r, const std::string& names) {
  std::size_t differing = 0;
  for (const Score& score : std::span(r.ranking).first(r.leading))
    differing = std::max(differing, score.differing());
  const std::string known = r.contested == 0 ? "No" : program::concat("Only ", r.contested);
  return differing == 0 || r.contested < 20
             ? program::concat(known, " of ", r.decisions,
                               " judged decisions had a choice, too few to tell executors apart (possible: ",
                               names, "). Record at a load at which callbacks wait for each other.")
             : program::concat("The recording does not tell ", names, " apart: they differ in at most ",
                               differing, " of ", r.contested, " contested decisions.");
}

std::string how_to_name(const Recognition& r) {
  const std::vector<std::string> names = r.names();
  return names.size() < 2
             ? ""
             : program::concat(" To import another of them, name it: `--executors ", names[1], "`.");
}

}  // namespace

std::vector<std::string> Recognition::names(bool unlikely_only) const {
  std::vector<std::string> names;
  for (const Score& score : std::span(ranking).first(leading))
    if (score.unlikely || !unlikely_only) names.push_back(score.hypothesis.label);
  return names;
}

std::string sentence(const Recognition& r) {
  if (r.ranking.empty()) return "No known executor runs such threads.";
  const std::string names = program::joined(r.names(), ", ");
  const Score& best = r.ranking.front();
  if (!r.stated.empty())
    return program::concat("The executor calls itself ", r.stated, ", which explains ", share_of(best, r),
                           ".");
  switch (r.verdict) {
    case Verdict::recognised:
      return program::concat(names, " explains ", share_of(best, r), next_one(r));
    case Verdict::tie:
      return tie(r) + how_to_name(r);
    case Verdict::undecided:
      return undecided(r, names) + how_to_name(r);
    case Verdict::none_fits:
      return program::concat("No known executor fits: the best one, ", best.hypothesis.label, ", explains ",
                             share_of(best, r), r.breaks.empty() ? "" : ". It first breaks ", r.breaks, ".");
  }
  return {};
}

Recognition recognise(const tracing::System& system, const RecordedGraph& graph, const RecordedSteps& steps,
                      const std::vector<Hypothesis>& possible, const std::string& stated) {
  return Recogniser(system, graph, steps).recognise(possible, stated);
}

ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                           const OrderEvidence& evidence) {
  const std::size_t nodes = system.nodes.size();
  std::vector<std::vector<std::int64_t>> of_nodes(nodes, std::vector<std::int64_t>(nodes, 0));
  const auto ahead = [&](std::uint32_t a, std::uint32_t b) -> std::int64_t {
    const TaskId first = graph.task_of[a], second = graph.task_of[b];
    const auto found = evidence.find(std::minmax(first, second));
    return found == evidence.end() ? 0 : first < second ? found->second : -found->second;
  };
  for (const auto& [pair, value] : evidence) {
    const std::uint32_t a = system.callbacks[graph.callback_of[pair.first]].node;
    const std::uint32_t b = system.callbacks[graph.callback_of[pair.second]].node;
    of_nodes[a][b] += value;
    of_nodes[b][a] -= value;
  }
  std::vector<std::uint32_t> callbacks, all_nodes(nodes);
  std::iota(all_nodes.begin(), all_nodes.end(), 0U);
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c)
    if (graph.task_of[c] != kNoTask) callbacks.push_back(c);
  return {in_order(all_nodes, [&](std::uint32_t a, std::uint32_t b) { return of_nodes[a][b]; }),
          in_order(callbacks, [&](std::uint32_t a, std::uint32_t b) {
            return system.callbacks[a].node == system.callbacks[b].node ? ahead(a, b) : 0;
          })};
}

}  // namespace hotpath::imports
