// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "simulation.hpp"

namespace independent {

/// In the order in which wait sets offer what is ready.
inline const std::array<std::string, 5> kKinds = {"timer", "subscription", "service", "client", "waitable"},
                                        kKindsOfStatic = {"subscription", "timer", "client", "service",
                                                          "waitable"};

inline constexpr Nanoseconds kNever = std::numeric_limits<Nanoseconds>::max();

struct Sample {
  std::int64_t sequence = 0;
  Nanoseconds published = 0, deadline = 0;
  int parent = -1;
  std::int64_t parent_sequence = 0;
  History history{};
};

/// A released job, a ready entity of a snapshot, or an event.
struct Ready {
  int task = 0;
  std::int64_t sequence = 0;  ///< Of timers.
  Nanoseconds timestamp = 0, release = 0, deadline = 0;
  std::int64_t activation = 0;  ///< Counts releases and arrivals.
  bool timer = false;
  std::int64_t rank = 0;  ///< As TaskState::rank.
};

struct TaskState {
  Nanoseconds next_call = kNever;  ///< Of timers, as in rcl.
  std::int64_t sequence = 0;       ///< Next timestamp of a timer, next sample of a subscription.
  bool armed = true;               ///< cbg: the timer thread watches the timer.
  std::int64_t armed_order = 0;    ///< cbg: of simultaneous timers, that watched for longest goes first.
  std::vector<Sample> unread{};
  std::int64_t rank = 0;  ///< Fixed priority.
};

struct Group {
  std::vector<Ready> ready{};
  bool listed = false;  ///< Among the ready groups, or running.
};

/// A sample that a node keeps.
struct Kept {
  int publisher = 0;
  History history{};
};

/// An executor's thread.
struct ThreadState {
  Thread thread;
  std::vector<Ready> queue{};  ///< Events, or the rest of the snapshot.
  std::vector<Group> groups{};
  std::vector<int> ready_groups{};
  bool again = false;                                   ///< The group of the running job is among them.
  std::vector<std::pair<int, Nanoseconds>> requests{};  ///< Of services that wait: task and arrival.
  Nanoseconds next_service = 0;                         ///< None runs ahead of its priority before.
  bool awake = false;
  std::int64_t since = 0;    ///< Orders threads of one priority: that awake for longest runs.
  std::optional<Job> job{};  ///< Decided for.
  bool started = false;
  Nanoseconds left = 0;  ///< Until its start, then until its end.
  History history{};     ///< Of the sample that it took.
  std::size_t row = 0;   ///< Of the started job in the result.
};

/// By task: the smaller, the more urgent under rm, dm or fp.
std::vector<std::int64_t> ranks_of(const Graph& graph, const std::string& policy, Fault fault);

/// The order of events under fixed priorities and deadlines.
bool precedes(const Executor& executor, Fault fault, const Ready& a, const Ready& b);

/// Adds the data of another message.
void merge(History& into, const History& from);

/// What the sample of one task hands on to messages of another task.
History handed_on(const Graph& graph, const History& history, int from, int to);

/// The data of a job that has taken a sample: its own start, if it is of a source, and what the sample hands
/// on.
History data_of_job(const Graph& graph, const Job& job, const History& sample);

/// The data of the chain's sources in a message; `oldest` is kNever if it has none.
Mark data_of(const Chain& chain, const History& history, Fault fault);

}  // namespace independent
