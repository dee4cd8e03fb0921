// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include "import/caret_parts.hpp"
#include "import/import_caret.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

constexpr const char* kExternal = "external";
/// Frequencies that differ by less fit alike.
constexpr double kSameFrequency = 0.03;

/// A callback of the graph in the making.
struct Draft {
  std::size_t node = 0;  ///< Index into the architecture's nodes.
  const CaretCallback* caret = nullptr;
  const CaretStats* stats = nullptr;  ///< nullptr: not measured.
  double hertz = 0;                   ///< 0: not known.
  Callback callback;

  [[nodiscard]] Duration typical_time() const {
    return stats == nullptr || stats->times.empty() ? Duration::zero()
                                                    : stats->times[stats->times.size() / 2].time;
  }
};

/// One topic that a node publishes.
struct Wanted {
  std::size_t node = 0;
  const CaretPublication* publication = nullptr;
};

double hertz_of(Duration period) { return 1e9 / static_cast<double>(period.count()); }

double distance(double a, double b) { return std::abs(std::log(a / b)); }

class CaretGraph {
 public:
  CaretGraph(const CaretArchitecture& architecture, const std::map<std::string, CaretStats>& stats)
      : architecture_(architecture), stats_(stats) {
    make_drafts();
    for (const CaretPath& path : architecture.paths) {
      for (const CaretStep& step : path.steps) {
        on_path_.insert({step.node, step.subscribed, step.published});
      }
    }
    assign_publications();
    add_external();
    make_nodes();
    add_chains(architecture_, out_);
    deploy();
    say();
  }

  ImportedGraph take() { return std::move(out_); }

 private:
  void make_drafts() {
    std::size_t idle = 0, twice = 0;
    for (std::size_t n = 0; n < architecture_.nodes.size(); ++n) {
      std::set<std::string> topics;
      for (const CaretCallback& caret : architecture_.nodes[n].callbacks) {
        const auto found = stats_.find(caret.name);
        const bool ran = found != stats_.end() && found->second.period;
        if (!stats_.empty() && !ran) {
          ++idle;
          continue;
        }
        if (caret.topic && !topics.insert(*caret.topic).second) {
          ++twice;
          continue;
        }
        drafts_.push_back(draft_of(n, caret, ran ? &found->second : nullptr));
        index_[caret.name] = drafts_.size() - 1;
        if (caret.topic) subscribers_[*caret.topic].push_back(drafts_.size() - 1);
      }
    }
    if (idle > 0) {
      out_.missing.push_back(concat(idle, " callbacks that did not run while CARET measured are left out."));
    }
    if (twice > 0) {
      out_.missing.push_back(concat(twice, " second subscriptions of a node to a topic are left out."));
    }
  }

  Draft draft_of(std::size_t n, const CaretCallback& caret, const CaretStats* stats) const {
    Draft draft{.node = n, .caret = &caret, .stats = stats, .hertz = 0, .callback = {}};
    Callback& c = draft.callback;
    const std::string node = graph_node_name(architecture_.nodes[n].name);
    c.task = concat(
        node, "/",
        caret.topic ? graph_topic_name(*caret.topic) : caret.name.substr(caret.name.find_last_of('/') + 1));
    if (!caret.topic) c.period = c.deadline = caret.period;
    if (stats != nullptr) {
      draft.hertz = hertz_of(*stats->period);
      if (!stats->times.empty()) set_times(c, stats->times);
    } else if (!caret.topic) {
      draft.hertz = hertz_of(caret.period);
    }
    return draft;
  }

  static void set_times(Callback& c, const std::vector<DurationQuantile>& times) {
    c.best = times.front().time;
    c.worst = times.back().time;
    if (times.size() <= 2) return;
    c.quantiles = times;
    c.measured = std::make_shared<const std::vector<Duration>>(values_of(times));
  }

  const std::string& node_name(const Draft& draft) const { return architecture_.nodes[draft.node].name; }

  bool on_path(const Draft& draft, const std::string& published) const {
    return draft.caret->topic && on_path_.contains({node_name(draft), *draft.caret->topic, published});
  }

  /// Of a topic, from what its subscribers measured; 0: not known.
  double frequency(const std::string& topic) const {
    double most = 0;
    if (const auto found = subscribers_.find(topic); found != subscribers_.end()) {
      for (const std::size_t s : found->second) {
        if (drafts_[s].stats != nullptr) most = std::max(most, drafts_[s].hertz);
      }
    }
    return most;
  }

  /// First what CARET tells, then what named paths need, then the rest: whoever comes last gives way where a
  /// cycle would close.
  void assign_publications() {
    std::vector<Wanted> told, on_paths, others;
    for (std::size_t n = 0; n < architecture_.nodes.size(); ++n) {
      for (const CaretPublication& p : architecture_.nodes[n].publications) {
        const auto needs = [&](const auto& step) {
          return std::get<0>(step) == architecture_.nodes[n].name && std::get<2>(step) == p.topic;
        };
        const bool needed = std::any_of(on_path_.begin(), on_path_.end(), needs);
        if (!p.callbacks.empty()) {
          told.push_back({n, &p});
        } else if (!subscribers_.contains(p.topic)) {
          ++unheard_;
        } else {
          (needed ? on_paths : others).push_back({n, &p});
        }
      }
    }
    for (const Wanted& w : told) assign_told(w);
    for (const Wanted& w : on_paths) assign_guessed(w);
    for (const Wanted& w : others) assign_guessed(w);
  }

  void assign_told(const Wanted& w) {
    for (const std::string& name : w.publication->callbacks) {
      if (const auto found = index_.find(name); found != index_.end()) {
        told_ += publish(found->second, w.publication->topic) ? 1 : 0;
      }
    }
  }

  void assign_guessed(const Wanted& w) {
    const std::string& topic = w.publication->topic;
    std::vector<std::size_t> candidates;
    for (std::size_t d = 0; d < drafts_.size(); ++d) {
      if (drafts_[d].node == w.node) candidates.push_back(d);
    }
    const double wanted = frequency(topic);
    const auto is_better = [&](std::size_t a, std::size_t b) {
      const Draft &first = drafts_[a], &second = drafts_[b];
      if (wanted > 0 && first.hertz > 0 && second.hertz > 0) {
        const double x = distance(first.hertz, wanted), y = distance(second.hertz, wanted);
        if (std::abs(x - y) > kSameFrequency) return x < y;
      }
      // Nothing measured: a timer is there to publish.
      const bool timer = !first.caret->topic, other_timer = !second.caret->topic;
      if (stats_.empty() && timer != other_timer) return timer;
      const bool p = on_path(first, topic), q = on_path(second, topic);
      return p != q ? p : first.typical_time() > second.typical_time();
    };
    std::stable_sort(candidates.begin(), candidates.end(), is_better);
    const auto found =
        std::find_if(candidates.begin(), candidates.end(), [&](std::size_t d) { return publish(d, topic); });
    if (found == candidates.end()) {
      unassigned_.push_back(graph_topic_name(topic));
      return;
    }
    ++guessed_;
    guesses_[*found].push_back(graph_topic_name(topic));
  }

  /// Whether the topic could be given to the callback.
  bool publish(std::size_t d, const std::string& topic) {
    Draft& draft = drafts_[d];
    const auto readers = subscribers_.find(topic);
    if (draft.caret->topic && readers != subscribers_.end()) {
      for (const std::size_t s : readers->second) {
        if (reaches(s, d)) {
          ++cycles_;
          return false;
        }
      }
    }
    Publication p;
    p.topic = graph_topic_name(topic);
    const double wanted = frequency(topic);
    if (wanted > 0 && draft.hertz > 0) {
      p.n = static_cast<std::uint32_t>(std::max(1L, std::lround(draft.hertz / wanted)));
    }
    draft.callback.publishes.push_back(std::move(p));
    published_[d].push_back(topic);
    return true;
  }

  bool reaches(std::size_t from, std::size_t to) const {
    if (from == to) return true;
    const auto topics = published_.find(from);
    if (topics == published_.end()) return false;
    return std::any_of(topics->second.begin(), topics->second.end(), [&](const std::string& topic) {
      const auto readers = subscribers_.find(topic);
      return readers != subscribers_.end() && std::any_of(readers->second.begin(), readers->second.end(),
                                                          [&](std::size_t s) { return reaches(s, to); });
    });
  }

  /// Timers that publish what nobody else does.
  void add_external() {
    std::set<std::string> published;
    for (const auto& [d, topics] : published_) published.insert(topics.begin(), topics.end());
    std::size_t silent = 0;
    for (const auto& [topic, readers] : subscribers_) {
      if (published.contains(topic)) continue;
      if (const double hertz = frequency(topic); hertz > 0) {
        Callback timer;
        std::string name = graph_topic_name(topic);
        timer.publishes.emplace_back().topic = name;
        std::replace(name.begin(), name.end(), '/', '.');
        timer.task = concat(kExternal, "/", name);
        timer.period = timer.deadline = Duration(std::llround(1e9 / hertz));
        external_.push_back(std::move(timer));
      } else {
        silent_.insert(topic);
        silent += readers.size();
      }
    }
    if (silent > 0) {
      out_.missing.push_back(
          concat(silent, " subscriptions to topics that no known callback publishes are left out."));
    }
  }

  void make_nodes() {
    if (!external_.empty()) {
      Node& node = out_.graph.nodes.emplace_back();
      node.name = kExternal;
      node.type = NodeType::callbacks;
      node.group_names = {"all"};
      node.groups = {CallbackGroup::reentrant};
      node.callbacks = external_;
      for (const Callback& c : external_) node.outputs.push_back(c.publishes.front().topic);
      out_.comments.of[kExternal] = "publishes what nobody known does, at the frequency measured";
    }
    for (std::size_t n = 0; n < architecture_.nodes.size(); ++n) make_node(n);
    if (!stats_.empty()) out_.graph.platform.execution_times = ExecutionTimeModel::measured;
  }

  void make_node(std::size_t n) {
    const CaretNode& caret = architecture_.nodes[n];
    Node node;
    node.name = graph_node_name(caret.name);
    node.type = NodeType::callbacks;
    std::map<std::string, std::uint32_t> group_of;
    for (const CaretGroup& group : caret.groups) {
      for (const std::string& name : group.callbacks) {
        group_of[name] = static_cast<std::uint32_t>(node.groups.size());
      }
      node.group_names.push_back(group.name.substr(group.name.find_last_of('/') + 1));
      node.groups.push_back(group.kind);
    }
    std::vector<std::size_t> kept;
    for (std::size_t d = 0; d < drafts_.size(); ++d) {
      Draft& draft = drafts_[d];
      if (draft.node != n || (draft.caret->topic && silent_.contains(*draft.caret->topic))) continue;
      kept.push_back(d);
      if (draft.caret->topic) {
        draft.callback.input = static_cast<std::uint32_t>(node.inputs.size());
        node.inputs.push_back({graph_topic_name(*draft.caret->topic), 1, {}});
      }
      const auto group = group_of.find(draft.caret->name);
      draft.callback.group =
          group != group_of.end() ? group->second : static_cast<std::uint32_t>(node.group_names.size());
    }
    if (kept.empty()) {
      ++empty_;
      return;
    }
    for (const std::size_t d : kept) {
      finish_rules(drafts_[d], node);
      if (const auto guess = guesses_.find(d); guess != guesses_.end()) {
        out_.comments.of[drafts_[d].callback.task] = "guessed: publishes " + joined(guess->second);
      }
      if (drafts_[d].callback.group == node.groups.size()) {
        node.groups.push_back(CallbackGroup::mutually_exclusive);
      }
      node.callbacks.push_back(drafts_[d].callback);
    }
    for (const Callback& c : node.callbacks) {
      for (const Publication& p : c.publishes) {
        if (std::ranges::count(node.outputs, p.topic) == 0) node.outputs.push_back(p.topic);
      }
    }
    out_.graph.nodes.push_back(std::move(node));
  }

  /// Timers take the newest samples that CARET's contexts name, other callbacks those of named paths.
  void finish_rules(Draft& draft, const Node& node) const {
    const std::string& name = node_name(draft);
    for (Publication& p : draft.callback.publishes) {
      std::set<std::uint32_t> inputs;
      for (std::uint32_t i = 0; i < node.inputs.size(); ++i) {
        const auto is_it = [&](const std::string& subscribed, const std::string& published) {
          return graph_topic_name(subscribed) == node.inputs[i].topic &&
                 graph_topic_name(published) == p.topic;
        };
        bool merged = std::any_of(on_path_.begin(), on_path_.end(), [&](const auto& step) {
          return std::get<0>(step) == name && is_it(std::get<1>(step), std::get<2>(step));
        });
        for (const CaretContext& context : architecture_.nodes[draft.node].contexts) {
          merged = merged || (!draft.callback.input && is_it(context.subscribed, context.published));
        }
        if (merged && draft.callback.input != i) inputs.insert(i);
      }
      if (p.n > 1) {
        p.rule = PublishRule::every;
      } else if (!inputs.empty()) {
        p.rule = PublishRule::last_of;
        p.of.assign(inputs.begin(), inputs.end());
      }
    }
  }

  void deploy() {
    std::map<std::string, std::string> task_of;
    for (const Draft& draft : drafts_) task_of[draft.caret->name] = draft.callback.task;
    out_.deployment = deployment_of(architecture_, task_of, make_tasks(out_.graph));
  }

  void say() {
    std::size_t timers = 0, subscriptions = 0;
    for (const Node& node : out_.graph.nodes) {
      subscriptions += node.inputs.size();
      timers += node.callbacks.size() - node.inputs.size();
    }
    out_.found.push_back(concat(out_.graph.nodes.size(), " nodes, ", timers, " timers, ", subscriptions,
                                " subscriptions, ", out_.deployment.executors.size(), " executors, ",
                                out_.graph.chains.size(), " chains."));
    out_.found.push_back(concat(told_, " publications by callbacks that CARET names, ", guessed_,
                                " guessed from frequencies and paths (marked in the file), ",
                                external_.size(), " topics from outside."));
    auto& missing = out_.missing;
    if (!unassigned_.empty()) {
      missing.push_back(concat("who publishes ", joined(unassigned_), "."));
    }
    if (unheard_ > 0) {
      missing.push_back(
          concat("who publishes ", unheard_, " topics to which nobody subscribes; they are left out."));
    }
    if (cycles_ > 0)
      missing.push_back(concat(cycles_, " guesses would have closed a cycle and were not taken."));
    if (empty_ > 0) missing.push_back(concat(empty_, " nodes without callbacks that ran are left out."));
    if (architecture_.services > 0) {
      missing.push_back(concat(architecture_.services, " callbacks of services are left out."));
    }
    missing.push_back("phases of timers; depths of subscriptions are taken as 1.");
    missing.push_back(stats_.empty() ? "how long callbacks work; --stats FOLDER reads it."
                                     : "execution times without preemption: CARET measures start to end.");
  }

  const CaretArchitecture& architecture_;
  const std::map<std::string, CaretStats>& stats_;
  std::vector<Draft> drafts_;
  std::map<std::string, std::size_t> index_;                             // by callback
  std::map<std::string, std::vector<std::size_t>> subscribers_;          // by topic
  std::map<std::size_t, std::vector<std::string>> published_;            // by draft
  std::set<std::tuple<std::string, std::string, std::string>> on_path_;  // node, taken, sent
  std::vector<Callback> external_;
  std::set<std::string> silent_;
  std::map<std::size_t, std::vector<std::string>> guesses_;
  std::vector<std::string> unassigned_;
  std::size_t told_ = 0, guessed_ = 0, unheard_ = 0, cycles_ = 0, empty_ = 0;
  ImportedGraph out_;
};

}  // namespace

ImportedGraph graph_of(const CaretArchitecture& architecture,
                       const std::map<std::string, CaretStats>& stats) {
  return CaretGraph(architecture, stats).take();
}

}  // namespace hotpath
