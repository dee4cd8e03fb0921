// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "import/caret_drafts.hpp"
#include "import/imported_graph.hpp"

namespace hotpath::imports {

namespace {

/// Frequencies that differ by less (in logarithms) fit equally well.
constexpr double kSameFrequency = 0.03;

/// A topic that some callback of a node publishes.
struct Wanted {
  std::size_t node;
  const std::string& topic;
};

double distance(double a, double b) { return std::abs(std::log(a / b)); }

class Assignment {
 public:
  Assignment(const CaretArchitecture& architecture, const CaretSteps& on_path, bool measured,
             CaretDrafts& drafts)
      : architecture_(architecture), on_path_(on_path), measured_(measured), drafts_(drafts) {}

  void assign_all() {
    std::vector<Wanted> on_paths, others;
    for (std::size_t n = 0; n < architecture_.nodes.size(); ++n) {
      for (const CaretPublication& p : architecture_.nodes[n].publications) {
        const bool needed = std::ranges::any_of(on_path_, [&](const auto& step) {
          return std::get<0>(step) == architecture_.nodes[n].name && std::get<2>(step) == p.topic;
        });
        if (!p.callbacks.empty()) {
          assign_known(p);
        } else if (!drafts_.subscribers.contains(p.topic)) {
          ++drafts_.unheard;
        } else {
          (needed ? on_paths : others).push_back({n, p.topic});
        }
      }
    }
    for (const Wanted& w : on_paths) assign_guessed(w);
    for (const Wanted& w : others) assign_guessed(w);
  }

 private:
  void assign_known(const CaretPublication& p) {
    for (const std::string& name : p.callbacks) {
      const auto draft = drafts_.index.find(name);
      if (draft != drafts_.index.end() && publish(draft->second, p.topic)) ++drafts_.known;
    }
  }

  void assign_guessed(const Wanted& w) {
    const std::string& topic = w.topic;
    std::vector<std::size_t> candidates;
    for (std::size_t d = 0; d < drafts_.all.size(); ++d) {
      if (drafts_.all[d].node == w.node) candidates.push_back(d);
    }
    const double wanted = drafts_.frequency(topic);
    const auto is_better = [&](std::size_t a, std::size_t b) {
      const CaretDraft &first = drafts_.all[a], &second = drafts_.all[b];
      if (wanted > 0 && first.hertz > 0 && second.hertz > 0) {
        const double x = distance(first.hertz, wanted), y = distance(second.hertz, wanted);
        if (std::abs(x - y) > kSameFrequency) return x < y;
      }
      // Without measurements a timer is the likelier publisher.
      const bool timer = !first.caret->topic, other_timer = !second.caret->topic;
      if (!measured_ && timer != other_timer) return timer;
      const bool p = on_path(first, topic), q = on_path(second, topic);
      return p != q ? p : first.typical_time() > second.typical_time();
    };
    std::stable_sort(candidates.begin(), candidates.end(), is_better);
    const auto publisher =
        std::find_if(candidates.begin(), candidates.end(), [&](std::size_t d) { return publish(d, topic); });
    if (publisher == candidates.end()) {
      drafts_.unassigned.push_back(graph_topic_name(topic));
      return;
    }
    ++drafts_.guessed;
    drafts_.guesses[*publisher].push_back(graph_topic_name(topic));
  }

  /// Lets the callback publish the topic. False: this would close a cycle.
  bool publish(std::size_t d, const std::string& topic) {
    CaretDraft& draft = drafts_.all[d];
    const auto readers = drafts_.subscribers.find(topic);
    if (draft.caret->topic && readers != drafts_.subscribers.end()) {
      for (const std::size_t s : readers->second) {
        if (reaches(s, d)) {
          ++drafts_.cycles;
          return false;
        }
      }
    }
    Publication p;
    p.topic = graph_topic_name(topic);
    const double wanted = drafts_.frequency(topic);
    if (wanted > 0 && draft.hertz > 0) {
      p.n = static_cast<std::uint32_t>(std::max(1L, std::lround(draft.hertz / wanted)));
    }
    draft.callback.publishes.push_back(std::move(p));
    drafts_.published[d].push_back(topic);
    return true;
  }

  bool reaches(std::size_t from, std::size_t to) const {
    if (from == to) return true;
    const auto topics = drafts_.published.find(from);
    if (topics == drafts_.published.end()) return false;
    return std::any_of(topics->second.begin(), topics->second.end(), [&](const std::string& topic) {
      const auto readers = drafts_.subscribers.find(topic);
      return readers != drafts_.subscribers.end() &&
             std::any_of(readers->second.begin(), readers->second.end(),
                         [&](std::size_t s) { return reaches(s, to); });
    });
  }

  bool on_path(const CaretDraft& draft, const std::string& published) const {
    const std::string& node = architecture_.nodes[draft.node].name;
    return draft.caret->topic && on_path_.contains({node, *draft.caret->topic, published});
  }

  const CaretArchitecture& architecture_;
  const CaretSteps& on_path_;
  const bool measured_;
  CaretDrafts& drafts_;
};

}  // namespace

void assign_publications(const CaretArchitecture& architecture, const CaretSteps& on_path, bool measured,
                         CaretDrafts& drafts) {
  Assignment(architecture, on_path, measured, drafts).assign_all();
}

}  // namespace hotpath::imports
