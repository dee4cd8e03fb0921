// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/thread_policy.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath::watch {

/// Where a number of a contract comes from.
enum class Origin : std::uint8_t { given, measured, derived };
constexpr auto enum_texts(Origin) {
  return std::to_array<EnumText<Origin>>(
      {{Origin::given, "given"}, {Origin::measured, "measured"}, {Origin::derived, "derived"}});
}

/// What a contract says: assumptions, the bounds that follow from them, and requirements.
enum class Clause : std::uint8_t {
  // Of callbacks.
  budget,            ///< Most time from start to end of a job.
  period,            ///< Of a timer.
  minimum_distance,  ///< Least time between two publications of a subscription's samples.
  maximum_distance,  ///< Most time between two starts of a timer's jobs, or two publications of samples.
  depth,             ///< Of a subscription's queue.
  publishes,         ///< Most messages of a topic by one job, on the stated topics only.
  response,          ///< Bound: most time from the timestamp of a job to its end.
  lost,              ///< Bound: most samples that are overwritten unread.
  // Of chains.
  hot_path,     ///< Bound: most time from the start of the last source's job to the start of the sink's.
  age,          ///< Bound: most time from the timestamp of the oldest source's job to the end of the sink's.
  requirement,  ///< Most age that the system can do with.
  // Of threads.
  policy,      ///< Scheduling policy and priority.
  processors,  ///< On which they may run.
  wait,        ///< Most time in a second that a thread which could run has no processor.
  serves,      ///< They run no other callbacks.
  // Of topics.
  publishers,  ///< No others publish the topic.
};

/// What a fact of an incident is. Terms are assumptions, bounds or requirements.
enum class Role : std::uint8_t {
  standstill,  ///< A process is gone, or a callback or a thread does not run.
  assumption,
  bound,
  requirement,
  circumstance,  ///< A wait of a thread, or a job.
};

/// Of a limit: ns, a count, processors, a scheduling policy, or what the contract lists.
enum class Unit : std::uint8_t { ms, count, processors, policy, stated };

/// How an observed value has to compare with the limit.
enum class Comparison : std::uint8_t { at_most, at_least, equal };

/// How a clause is written, compared and told.
struct ClauseTraits {
  Clause value;
  const char* text;  ///< Key in files and in JSON.
  Unit unit;
  bool zero = false;  ///< Whether the limit may be 0.
  Role role = Role::assumption;
  Comparison comparison = Comparison::at_most;
  const char* deed = " ";  ///< In sentences, between the subject and the observed value.
};

/// By clause. A bound is 0 for a callback that only stores its sample and always goes first.
inline constexpr auto kClauses = [] {
  using C = Clause;
  constexpr auto kAssumption = Role::assumption, kBound = Role::bound;
  constexpr auto kMost = Comparison::at_most, kLeast = Comparison::at_least, kEqual = Comparison::equal;
  return std::to_array<ClauseTraits>({
      {C::budget, "budget_ms", Unit::ms, false, kAssumption, kMost, " ran "},
      {C::period, "period_ms", Unit::ms, false, kAssumption, kEqual, " has a period of "},
      {C::minimum_distance, "minimum_distance_ms", Unit::ms, true, kAssumption, kLeast,
       " got samples at a distance of "},
      {C::maximum_distance, "maximum_distance_ms", Unit::ms, false, kAssumption, kMost, " got nothing for "},
      {C::depth, "depth", Unit::count, false, kAssumption, kEqual, " has a queue depth of "},
      {C::publishes, "publishes", Unit::stated},
      {C::response, "response_ms", Unit::ms, true, kBound, kMost, " responded after "},
      {C::lost, "lost", Unit::count, true, kBound, kMost, " lost samples: "},
      {C::hot_path, "hot_path_ms", Unit::ms, true, kBound, kMost, " took "},
      {C::age, "age_ms", Unit::ms, true, kBound, kMost, " took "},
      {C::requirement, "requirement_ms", Unit::ms, false, Role::requirement, kMost, " took "},
      {C::policy, "policy", Unit::policy},
      {C::processors, "processors", Unit::processors},
      {C::wait, "wait_ms", Unit::ms, true, kAssumption, kMost, " waited for a processor for "},
      {C::serves, "serves", Unit::stated},
      {C::publishers, "publishers", Unit::stated},
  });
}();
constexpr auto enum_texts(Clause) { return kClauses; }
[[nodiscard]] constexpr const ClauseTraits& traits_of(Clause clause) {
  return kClauses[static_cast<std::size_t>(clause)];
}
[[nodiscard]] constexpr Role role_of(Clause clause) { return traits_of(clause).role; }

struct Term {
  Clause clause;
  std::int64_t limit = 0;  ///< ns or a count.
  Origin origin = Origin::given;
  /// minimum_distance: the limits from one publication to the second, third ... after it, in ns.
  std::vector<std::int64_t> further = {};
  ThreadPolicy policy = {};          ///< policy.
  std::vector<int> processors = {};  ///< processors: ascending.
};

/// A topic that a callback publishes, at most once in each job.
struct StatedPublication {
  std::string topic;
  /// Topics of the node whose latest samples enter the message, besides that of the callback.
  std::vector<std::string> with = {};
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
};

/// A path of data. Callbacks are indices into the contract's.
struct ChainContract {
  std::string name;
  std::vector<std::uint32_t> sources = {}, sinks = {};
  std::vector<Term> terms = {};
};

/// The threads of an executor.
struct ThreadContract {
  std::string name;
  std::vector<std::uint32_t> callbacks = {};  ///< That they serve.
  std::vector<Term> terms = {};
};

/// The assumptions under which the bounds of a system hold.
struct Contract {
  std::vector<CallbackContract> callbacks;
  std::vector<ChainContract> chains;
  std::vector<ThreadContract> threads;
};

/// Throw InputError, which names file, line and remedy. `text`: the content of the file.
[[nodiscard]] Contract read_contract(const std::string& file);
[[nodiscard]] Contract parse_contract(const std::string& file, const std::string& text);

}  // namespace hotpath::watch
