// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>

#include "simulation_state.hpp"

namespace independent {

/// The samples that nodes keep, and what their jobs publish. A copy has samples of its own.
class Nodes {
 public:
  Nodes(const Graph& graph, Fault fault) : graph_(&graph), fault_(fault), jobs_(graph.tasks.size()) {
    for (const std::size_t inputs : graph.slots) slots_.emplace_back(inputs);
  }

  const std::vector<std::vector<std::optional<Kept>>>& slots() const { return slots_; }
  const std::vector<std::int64_t>& jobs() const { return jobs_; }

  void store(const Job& job, const History& sample) {
    for (const auto& [set, position] : task(job).stores)
      slots_[static_cast<std::size_t>(set)][static_cast<std::size_t>(position)] = {job.parent, sample};
  }

  /// If all publications wait for sets, a job that completes none takes no time.
  bool works(const Task& t) const {
    const auto waits = [&](const Publication& p) { return p.rule == Rule::all_new && !complete(p); };
    return t.publications.empty() || fault_ == Fault::incomplete_set_works ||
           !std::ranges::all_of(t.publications, waits);
  }

  /// A job that took a sample ends.
  void publish(const Job& job, const History& sample, const std::function<void(const Output&)>& observed,
               const std::function<void(int reader, const History&)>& send) {
    const Task& t = task(job);
    const History own = data_of_job(*graph_, job, sample);
    const std::int64_t count = ++jobs_[static_cast<std::size_t>(job.task)];
    std::vector<bool> seen(graph_->chains.size(), false);
    if (t.publications.empty()) observe(job, own, seen, observed);
    for (const Publication& p : t.publications) {
      const std::int64_t turn = fault_ == Fault::every_from_first ? 1 % p.every : 0;
      if (p.rule == Rule::every && count % p.every != turn) continue;
      if (p.rule == Rule::all_new && !complete(p)) continue;
      History history = own;
      if (p.slots >= 0) {
        for (std::optional<Kept>& input : slots_[static_cast<std::size_t>(p.slots)]) {
          if (input) merge(history, handed_on(*graph_, input->history, input->publisher, job.task));
          const Fault keeps = p.rule == Rule::all_new ? Fault::join_keeps_slots : Fault::last_of_repeats;
          if (fault_ != keeps) input.reset();
        }
      }
      observe(job, history, seen, observed);
      std::vector<int> readers = p.readers;
      if (fault_ == Fault::delivery_reversed) std::ranges::reverse(readers);
      for (const int reader : readers) send(reader, history);
    }
  }

 private:
  const Task& task(const Job& job) const { return graph_->tasks[static_cast<std::size_t>(job.task)]; }

  bool complete(const Publication& publication) const {
    const auto full = [](const std::optional<Kept>& input) { return input.has_value(); };
    const auto& inputs = slots_[static_cast<std::size_t>(publication.slots)];
    return fault_ == Fault::join_of_any ? std::ranges::any_of(inputs, full)
                                        : std::ranges::all_of(inputs, full);
  }

  /// The first message with data of a source counts for a chain.
  void observe(const Job& job, const History& history, std::vector<bool>& seen,
               const std::function<void(const Output&)>& observed) const {
    for (std::size_t c = 0; c < graph_->chains.size(); ++c) {
      if (!graph_->chains[c].is_sink[static_cast<std::size_t>(job.task)] || seen[c]) continue;
      const Mark data = data_of(graph_->chains[c], history, fault_);
      if (data.oldest == kNever) continue;
      seen[c] = true;
      observed({static_cast<int>(c), job.sequence, job.start - data.latest_start, job.finish - data.oldest,
                data.jobs > 1});
    }
  }

  const Graph* graph_;
  Fault fault_;
  std::vector<std::int64_t> jobs_;                         ///< By task, for `every: N`.
  std::vector<std::vector<std::optional<Kept>>> slots_{};  ///< Newest samples of fusions and cyclic nodes.
};

}  // namespace independent
