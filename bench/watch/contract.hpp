// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "guarantees/analyze.hpp"
#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/thread_policy.hpp"

namespace hotpath::watch {

/// Where a number of a contract comes from.
enum class Origin : std::uint8_t { given, measured, derived };
constexpr auto enum_texts(Origin) { return texts_in_order<Origin>({"given", "measured", "derived"}); }

/// What a term is about.
enum class Kind : std::uint8_t { callback, chain, thread, topic };
constexpr auto enum_texts(Kind) { return texts_in_order<Kind>({"callback", "chain", "thread", "topic"}); }

enum class Clause : std::uint8_t {
  publishes,         ///< Most messages of a topic by one job, on the stated topics only.
  budget,            ///< Most time from start to end of a job.
  period,            ///< Of a timer.
  minimum_distance,  ///< Least time between two publications of a subscription's samples.
  maximum_distance,  ///< Most time between two starts of a timer's jobs, or two publications of samples.
  depth,             ///< Of a subscription's queue.
  response,          ///< Most time from the timestamp of a job to its end.
  lost,              ///< Most samples that are overwritten unread.
  hot_path,          ///< Most time from the start of the last source's job to the start of the sink's.
  age,               ///< Most time from the timestamp of the oldest source's job to the end of the sink's.
  requirement,       ///< Most age that the system can do with.
  serves,            ///< Threads run no other callbacks.
  policy,            ///< Scheduling policy and priority.
  processors,        ///< On which threads may run.
  wait,              ///< Most time in a second that a thread which could run has no processor.
  publishers,        ///< No others publish the topic.
};

/// What a fact of an incident is, the most severe first. Terms are assumptions, the bounds that follow, or
/// requirements.
enum class Role : std::uint8_t {
  gone,        ///< A process or a node.
  never_runs,  ///< A callback.
  standstill,  ///< A thread does not run.
  clock,       ///< The clock was set.
  assumption,
  bound,
  requirement,
  circumstance,  ///< A wait of a thread, or a job.
};

/// Of a limit: ns, a count, processors, a scheduling policy, or what the contract lists.
enum class Unit : std::uint8_t { ms, count, processors, policy, stated };

/// How an observed value has to compare with the limit.
enum class Comparison : std::uint8_t { at_most, at_least, equal };

/// The callbacks that may have a term.
enum class Holders : std::uint8_t { all, timers, subscriptions };

/// A term: how it is written, compared and told.
struct ClauseTraits {
  Clause value;
  const char* text;  ///< Key in files and in JSON.
  Kind of;
  Unit unit;
  bool zero = false;  ///< Whether the limit may be 0.
  Role role = Role::assumption;
  const char* deed = " ";  ///< In sentences, between the subject and the observed value.
  Comparison comparison = Comparison::at_most;
  Holders holders = Holders::all;
};

/// By clause, in the order of verdicts. A bound is 0 for a callback that only stores its sample and always
/// goes first.
inline constexpr auto kClauses = [] {
  using enum Clause;
  using enum Kind;
  using enum Comparison;
  using enum Holders;
  constexpr Unit kMs = Unit::ms, kCount = Unit::count, kStated = Unit::stated;
  constexpr Role kAssumption = Role::assumption, kBound = Role::bound;
  return std::to_array<ClauseTraits>({
      {publishes, "publishes", callback, kStated},
      {budget, "budget_ms", callback, kMs, false, kAssumption, " ran "},
      {period, "period_ms", callback, kMs, false, kAssumption, " has a period of ", equal, timers},
      {minimum_distance, "minimum_distance_ms", callback, kMs, true, kAssumption,
       " got samples at a distance of ", at_least, subscriptions},
      {maximum_distance, "maximum_distance_ms", callback, kMs, false, kAssumption, " got nothing for "},
      {depth, "depth", callback, kCount, false, kAssumption, " has a queue depth of ", equal, subscriptions},
      {response, "response_ms", callback, kMs, true, kBound, " responded after "},
      {lost, "lost", callback, kCount, true, kBound, " lost samples: ", at_most, subscriptions},
      {hot_path, "hot_path_ms", chain, kMs, true, kBound, " took "},
      {age, "age_ms", chain, kMs, true, kBound, " took "},
      {requirement, "requirement_ms", chain, kMs, false, Role::requirement, " took "},
      {serves, "serves", thread, kStated},
      {policy, "policy", thread, Unit::policy},
      {processors, "processors", thread, Unit::processors},
      {wait, "wait_ms", thread, kMs, true, kAssumption, " waited for a processor for "},
      {publishers, "publishers", topic, kStated},
  });
}();
constexpr auto enum_texts(Clause) { return kClauses; }
[[nodiscard]] constexpr const ClauseTraits& traits_of(Clause clause) {
  return kClauses[static_cast<std::size_t>(clause)];
}
static_assert(std::ranges::all_of(kClauses, [](const auto& row) { return &row == &traits_of(row.value); }));

struct Term {
  Clause clause;
  std::int64_t limit = 0;  ///< ns or a count.
  Origin origin = Origin::given;
  /// minimum_distance: the limits from one publication to the second, third ... after it, in ns.
  std::vector<std::int64_t> further = {};
  ThreadPolicy policy = {};          ///< policy.
  std::vector<int> processors = {};  ///< processors: ascending.
};
/// nullptr: there is none of this clause.
[[nodiscard]] const Term* find(const std::vector<Term>& terms, Clause clause);

/// A topic that a callback publishes, at most once in each job unless `several`.
struct StatedPublication {
  std::string topic;
  /// Topics of the node whose latest samples enter the message, besides that of the callback.
  std::vector<std::string> with = {};
  bool several = false;  ///< A synchroniser may complete several sets in one job.
};

/// A callback by the names that a graph gives to nodes and topics.
struct CallbackContract {
  std::string node;
  std::string topic;        ///< Or the name of a service; empty: a timer.
  std::uint32_t timer = 1;  ///< Number among the node's timers, from 1.
  std::vector<Term> terms;
  std::vector<StatedPublication> publishes = {};
  bool service = false;

  /// `Node/topic`, `Node/name (service)`, `Node (timer)` or `Node (timer 2)`.
  [[nodiscard]] std::string name() const;
  /// nullptr: the contract does not let it publish the topic.
  [[nodiscard]] const StatedPublication* publication(const std::string& published) const;
};

/// A path of data, or the threads of an executor. Callbacks are indices into the contract's.
struct Group {
  std::string name;
  std::vector<std::uint32_t> callbacks = {};  ///< Sources of the path, or those that the threads serve.
  std::vector<std::uint32_t> sinks = {};      ///< Of a path.
  std::vector<Term> terms = {};
};

/// The assumptions under which the bounds of a system hold.
struct Contract {
  std::vector<CallbackContract> callbacks;
  std::vector<Group> chains, threads;
  std::string rests_on{}, assumed{};  ///< Premises of its bounds, stated and not, for people.
};

/// Throw InputError, which names file, line and remedy. `text`: the content of the file.
[[nodiscard]] Contract read_contract(const std::string& file);
[[nodiscard]] Contract parse_contract(const std::string& file, const std::string& text);
/// As YAML: the inverse.
[[nodiscard]] std::string contract_text(const Contract& contract);

/// The contract of a graph under an executor or deployment: budgets, periods, depths, publications and
/// threads, and the bounds and distances that follow from them for any phases.
[[nodiscard]] Contract stated_contract(const Graph& graph, const GraphTasks& tasks,
                                       const setup::ExecutorSpec& executor);
/// The same for the only executor or deployment of `options`. Throws UsageError and InputError.
[[nodiscard]] Contract stated_contract(const guarantees::AnalyzeOptions& options);
/// That of the run `--trace`, with its executor: limits are the worst recorded values, and this margin.
[[nodiscard]] Contract recorded_contract(const guarantees::AnalyzeOptions& options, double margin_percent);

}  // namespace hotpath::watch
