// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include "import/caret_drafts.hpp"
#include "import/import_caret.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

constexpr const char* kExternal = "external";

class CaretGraph {
 public:
  CaretGraph(const CaretArchitecture& architecture, const std::map<std::string, CaretStats>& stats)
      : architecture_(architecture), measured_(!stats.empty()), drafts_(make_drafts(architecture, stats)) {
    for (const CaretPath& path : architecture.paths) {
      for (const CaretStep& step : path.steps) {
        on_path_.insert({step.node, step.subscribed, step.published});
      }
    }
    assign_publications(architecture_, on_path_, measured_, drafts_);
    add_external();
    make_nodes();
    add_chains(architecture_, out_);
    deploy();
    describe();
  }

  ImportedGraph take() { return std::move(out_); }

 private:
  /// Adds timers for topics that no callback publishes.
  void add_external() {
    std::set<std::string> published;
    for (const auto& [d, topics] : drafts_.published) published.insert(topics.begin(), topics.end());
    std::size_t silent = 0;
    for (const auto& [topic, readers] : drafts_.subscribers) {
      if (published.contains(topic)) continue;
      if (const double hertz = drafts_.frequency(topic); hertz > 0) {
        Callback timer;
        std::string name = graph_topic_name(topic);
        timer.publishes.emplace_back().topic = name;
        std::replace(name.begin(), name.end(), '/', '.');
        timer.task = program::concat(kExternal, "/", name);
        timer.period = timer.deadline = Duration(std::llround(1e9 / hertz));
        external_.push_back(std::move(timer));
      } else {
        silent_.insert(topic);
        silent += readers.size();
      }
    }
    if (silent > 0) {
      out_.missing.push_back(
          program::concat(silent, " subscriptions to topics that no known callback publishes are left out."));
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
      out_.comments.of[kExternal] =
          "publishes the topics without a known publisher, at the measured frequency";
    }
    for (std::size_t n = 0; n < architecture_.nodes.size(); ++n) make_node(n);
    if (measured_) out_.graph.platform.execution_times = ExecutionTimeModel::measured;
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
      node.group_names.push_back(graph_topic_name(group.name.substr(group.name.find_last_of('/') + 1)));
      node.groups.push_back(group.kind);
    }
    std::vector<std::size_t> kept;
    for (std::size_t d = 0; d < drafts_.all.size(); ++d) {
      CaretDraft& draft = drafts_.all[d];
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
      finish_rules(drafts_.all[d], node);
      if (const auto guess = drafts_.guesses.find(d); guess != drafts_.guesses.end()) {
        out_.comments.of[drafts_.all[d].callback.task] =
            "guessed: publishes " + program::joined(guess->second);
      }
      if (drafts_.all[d].callback.group == node.groups.size()) {
        node.groups.push_back(CallbackGroup::mutually_exclusive);
      }
      node.callbacks.push_back(drafts_.all[d].callback);
    }
    for (const Callback& c : node.callbacks) {
      for (const Publication& p : c.publishes) {
        if (std::ranges::count(node.outputs, p.topic) == 0) node.outputs.push_back(p.topic);
      }
    }
    out_.graph.nodes.push_back(std::move(node));
  }

  /// Timers use the newest samples of CARET's contexts, other callbacks those of named paths.
  void finish_rules(CaretDraft& draft, const Node& node) const {
    const std::string& name = architecture_.nodes[draft.node].name;
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
    for (const CaretDraft& draft : drafts_.all) task_of[draft.caret->name] = draft.callback.task;
    out_.deployment = deployment_of(architecture_, task_of, make_tasks(out_.graph));
  }

  void describe() {
    out_.summary.push_back(counts_of(out_));
    out_.summary.push_back(program::concat(drafts_.known, " publications by callbacks that CARET names, ",
                                           drafts_.guessed,
                                           " guessed from frequencies and paths (marked in the file), ",
                                           external_.size(), " topics from outside."));
    auto& missing = out_.missing;
    if (drafts_.idle > 0)
      missing.push_back(
          program::concat(drafts_.idle, " callbacks that did not run while CARET measured are left out."));
    if (drafts_.twice > 0)
      missing.push_back(
          program::concat(drafts_.twice, " second subscriptions of a node to a topic are left out."));
    if (!drafts_.unassigned.empty()) {
      missing.push_back(program::concat("the publishers of ", program::joined(drafts_.unassigned), "."));
    }
    if (drafts_.unheard > 0) {
      missing.push_back(program::concat("the publishers of ", drafts_.unheard,
                                        " topics without subscribers; the topics are left out."));
    }
    if (drafts_.cycles > 0)
      missing.push_back(
          program::concat(drafts_.cycles, " guesses would have closed a cycle and were rejected."));
    if (empty_ > 0)
      missing.push_back(program::concat(empty_, " nodes without callbacks that ran are left out."));
    if (architecture_.services > 0) {
      missing.push_back(program::concat(architecture_.services, " callbacks of services are left out."));
    }
    missing.push_back("phases of timers; depths of subscriptions are taken as 1.");
    missing.push_back(measured_ ? "execution times without preemption: CARET measures start to end."
                                : "execution times; add --stats FOLDER.");
  }

  const CaretArchitecture& architecture_;
  const bool measured_;
  CaretDrafts drafts_;
  CaretSteps on_path_;
  std::vector<Callback> external_;
  std::set<std::string> silent_;
  std::size_t empty_ = 0;  // nodes
  ImportedGraph out_;
};

}  // namespace

ImportedGraph graph_of(const CaretArchitecture& architecture,
                       const std::map<std::string, CaretStats>& stats) {
  return CaretGraph(architecture, stats).take();
}

}  // namespace hotpath::imports
