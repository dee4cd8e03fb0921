// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "hotpath/tracing/event.hpp"

namespace hotpath::tracing {

/// No entity, or unknown.
inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// rclcpp writes no events of callbacks of clients and waitables. Jobs of a `client` are responses;
/// `unannounced` are jobs of waitables, and responses whose service is not traced.
enum class CallbackKind : std::uint8_t { timer, subscription, service, client, unannounced, unknown };

/// One callback, all callbacks of one subscription, or all unannounced ones of a thread or a node. In
/// the order of creation.
struct Callback {
  CallbackKind kind = CallbackKind::unknown;
  bool intra_process = false;  ///< Subscriptions: took a sample within the process, as a waitable.
  bool of_action = false;  ///< The same: without a callback of its own; an action's client takes its samples.
  std::uint32_t node = kNone;
  std::uint32_t topic = kNone;                       ///< All but timers: index into topics.
  std::uint32_t depth = 0;                           ///< The same: history depth; 0: unknown, or keep all.
  Duration period{};                                 ///< Timers.
  Time created{};                                    ///< Timers: its creation.
  std::uint64_t jobs = 0;                            ///< Jobs that ended.
  std::uint64_t never_ended = 0;                     ///< Jobs without an end in the trace.
  Duration busy{};                                   ///< Start to end of all jobs.
  std::map<std::uint32_t, std::uint64_t> threads;    ///< Jobs by thread.
  std::map<std::uint32_t, std::uint64_t> published;  ///< Messages that its jobs published, by topic.
  std::uint64_t samples = 0;                         ///< Subscriptions: published for it.
  Time published_for_it{};                           ///< The same: the latest traced publication.
  std::uint64_t strangers = 0;  ///< Subscriptions: samples taken without a traced publication.
  std::string symbol = {};      ///< The function, as the linker names it; empty: unknown.
};

struct Topic {
  std::string name;                          ///< Of a topic or a service.
  std::vector<std::uint32_t> subscriptions;  ///< Callbacks.
};

/// The id of an endpoint in the middleware (GUID): its participant, and its number there.
struct EndpointId {
  std::uint64_t first = 0, second = 0;  ///< Its 16 bytes, the first one highest; both 0: unknown.
  /// The vendor of the middleware (OMG's list): 0x010f is Fast DDS.
  [[nodiscard]] std::uint32_t vendor() const { return static_cast<std::uint32_t>(first >> 48); }
  /// Three bytes: consecutive in the order of creation under Fast DDS.
  [[nodiscard]] std::uint32_t number() const { return static_cast<std::uint32_t>(second & 0xffffffff) >> 8; }
};

/// An endpoint of the middleware.
struct Endpoint {
  enum class Kind : std::uint8_t { publisher, subscription, service, client };
  Kind kind = Kind::publisher;
  std::uint32_t process = 0;
  EndpointId id;                   ///< Publishers and subscriptions, from Jazzy on (rcl 5 has some).
  std::uint32_t node = kNone;      ///< Publishers.
  std::uint32_t topic = kNone;     ///< kNone also for endpoints of the middleware itself.
  std::uint32_t callback = kNone;  ///< Subscriptions.
  std::uint64_t publications = 0;  ///< Publishers.
};

struct ServiceClient {
  std::uint32_t process = 0, node = kNone;
  std::uint32_t service = kNone, response = kNone;  ///< Topics: the service, and its responses.
  std::uint32_t callback = kNone;                   ///< None without a job.
};

struct Thread {
  std::uint32_t process = 0, id = 0;
  std::uint64_t jobs = 0, waits = 0;
  std::map<std::int32_t, std::uint64_t> processors;  ///< Jobs by the processor on which they ended.
};

/// Most time from rcl's reading of the clock, from which a timer's period counts, to the event of its
/// creation.
inline constexpr Duration kCreationEvent = std::chrono::milliseconds(1);
/// A thread that ran nothing for so long had nothing to run: no event comes later by waking up or by building
/// a wait set alone.
inline constexpr Duration kIdleThread = std::chrono::microseconds(200);

/// An executor that describes itself: hotpath_rclcpp's PriorityExecutor does.
struct StatedExecutor {
  std::uint32_t process = 0;
  std::string name;                 ///< With its variants, `rm-ro:first`.
  std::set<std::uint32_t> threads;  ///< That ran its jobs.
  bool states_ends = false;         ///< Of clients' and waitables' jobs.
  /// By callback: the level in force at the end of the trace, smaller first. Under rm and dm a time
  /// in ns. Callbacks without one have none.
  std::map<std::uint32_t, std::int64_t> levels;
};

/// A running system, as far as its events describe it.
struct System {
  std::string rcl_version;            ///< As rcl states it: that of tracetools. Empty: unknown.
  std::set<std::uint32_t> processes;  ///< Ids.
  std::uint64_t ended_processes = 0;  ///< That were forgotten.
  /// Names with namespaces, `/perception/filter`, by node; two nodes of one name are two entries.
  std::vector<std::string> nodes;
  std::vector<Callback> callbacks;
  std::vector<Topic> topics;
  std::vector<Thread> threads;
  std::vector<Endpoint> endpoints;  ///< In the order of creation.
  std::vector<StatedExecutor> stated_executors;
  std::vector<ServiceClient> clients;
  std::uint64_t reused_handles = 0;  ///< Callbacks at the address of an earlier callback.
  std::uint64_t ends_without_start = 0;
  std::uint64_t ignored = 0;  ///< Descriptions, and starts of unknown callbacks, for which there is no room.
  /// Possible callbacks of clients and waitables in processes where several threads wait: a trace does
  /// not tell them from waiting for another thread.
  std::uint64_t unclear_callbacks = 0;
};

/// A job by its callback and its number among the callback's jobs, from 0.
struct JobRef {
  std::uint32_t callback = kNone;
  std::uint64_t number = 0;
  friend bool operator==(const JobRef&, const JobRef&) = default;
};

/// A message on its way to one subscription.
struct Sample {
  std::uint64_t sequence = 0;  ///< Among the messages for this subscription, from 0.
  Time published{};
  JobRef parent;  ///< Callback kNone: published outside of callbacks, or not traced.
};

/// A sample that its subscription never took.
struct LostSample {
  std::uint32_t subscription = kNone;  ///< Callback.
  Sample sample;
  bool queued = false;  ///< Unread at the end of the trace, not overwritten.
};

struct Publication {
  std::uint32_t topic = kNone;
  Time at{};
  std::uint64_t event = 0;  ///< As Job::started.
};

/// One run of a callback.
struct Job {
  JobRef ref;
  std::uint32_t thread = kNone;  ///< Index into threads.
  std::int32_t processor = -1;   ///< Of its end; before that, of its start.
  Time start{}, finish{};
  /// Positions of both among the events of the trace; they decide the order within one instant.
  std::uint64_t started = 0, finished = 0;
  /// The question for work that the job answers, and its position among the events; Time{}: the
  /// executor writes no such events. Threads that share a wait set decide in the order of questions.
  Time decided{};
  std::uint64_t question = 0;
  bool ended = true;
  bool waited = false;      ///< The executor waited for work since the previous job of the thread.
  bool has_sample = false;  ///< True for jobs of subscriptions.
  Sample sample{};
  std::vector<Publication> published{};
  /// What the executor states of the job: its nominal instant or arrival, and when it was queued.
  /// Time{}: it does not state that.
  Time timestamp{}, release{};
};

}  // namespace hotpath::tracing
