// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hotpath/tracing/system.hpp"

namespace hotpath::tracing {

/// Receives assembled jobs in the order of their ends, and lost samples. A running system is also
/// followed by the starts and publications of jobs, in the order of time.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void started(const Job& /*job*/) {}
  /// A publication of a job that has not ended.
  virtual void published(const Job& /*job*/, const Publication& /*publication*/) {}
  virtual void ended(Job&& job) = 0;
  virtual void lost(const LostSample& sample) = 0;
};

/// Assembles nodes, callbacks, jobs and samples from events, whether of a file or of a running
/// system. A job lasts from the start to the end of a callback on one thread. Its sample is the last
/// one that the thread took before. The sample comes from the publication with the same source
/// timestamp; where publications have none (Humble), from the nearest one. Memory is bounded by
/// entities, open jobs with their publications, and unread samples.
class Assembler {
 public:
  /// `most_entities`: of a system that runs for days. Its further entities are ignored, its timers
  /// that follow one another are one callback, and a sample that may never have reached its
  /// subscription is not lost. 0: of a trace, which accounts for each timer and sample.
  explicit Assembler(Sink& sink, std::size_t most_entities = 0)
      : sink_(sink), most_entities_(most_entities) {}

  /// The next event in the order of time. A job that it ends is passed to the sink.
  void event(const Event& e);
  /// Forgets a thread that has ended, unless a job of it is open. Its place in the system is free for
  /// another thread, and has the id 0 until then.
  void forget_thread(std::uint32_t process, std::uint32_t thread);
  /// Forgets a process that has ended: gives up its open jobs, and ends its subscriptions.
  void forget_process(std::uint32_t process);
  /// At the end of the trace: passes open jobs and unread samples to the sink.
  void finish();

  [[nodiscard]] const System& system() const { return system_; }

 private:
  /// History depth of a service (rmw_qos_profile_services_default).
  static constexpr std::uint32_t kServiceDepth = 10;
  /// A wait-set executor that ran nothing asks again sooner.
  static constexpr Duration kLeastUnannounced = std::chrono::microseconds(20);
  /// Most unread samples of a subscription that keeps all.
  static constexpr std::size_t kKeepAll = 1000;
  // Most of a system that runs for days:
  static constexpr std::size_t kMostAddresses = 1'000'000;
  static constexpr std::size_t kMostUnknown = 10'000;   ///< Callbacks that no event describes.
  static constexpr std::size_t kMostPublished = 1'000;  ///< Messages of a job that are kept.

  /// An address, which is unique in its process.
  struct Handle {
    std::uint32_t process;
    std::uint64_t address;
    bool operator==(const Handle&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Handle& h) const {
      return std::hash<std::uint64_t>{}(h.address * 31 + h.process);
    }
  };
  template <class T>
  using ByHandle = std::unordered_map<Handle, T, Hash>;
  struct Timer {
    Duration period{};
    Time created{};
    std::uint64_t address = 0;  ///< Of its callback; 0: not yet known.
    std::uint32_t callback = kNone;
  };
  struct Service {
    std::uint32_t node = kNone, topic = kNone;
  };
  /// A response on its way.
  struct Response {
    std::uint32_t client = kNone;
    Time at{};
    JobRef parent;
  };
  struct Unread {
    Sample sample;
    std::uint64_t publication = 0;
    std::uint32_t publisher = kNone;    ///< Endpoint.
    std::uint64_t source_ns = 0;        ///< 0: the publication has no timestamp.
    std::optional<std::uint64_t> slot;  ///< Intra-process: place in the ring buffer.
    bool passed = false;                ///< A later sample of its publisher was taken.
  };
  struct CallbackState {
    std::deque<Unread> unread;
    std::uint64_t samples = 0, jobs = 0;   ///< Next numbers.
    std::uint32_t process = 0;             ///< Subscriptions.
    std::set<std::uint32_t> taken_from{};  ///< Publishers.
    /// It has taken nothing since its node subscribed to the topic again: it may have been destroyed.
    bool doubtful = false;
  };
  struct ThreadState {
    std::uint32_t index = kNone;
    std::optional<Time> asked;  ///< A wait-set executor asked for work then, and nothing was announced since.
    std::uint64_t asked_at = 0;  ///< The event.
    Time question{};             ///< The last such question before the next job, announced or not.
    bool unannounced = false;    ///< The outermost open job has no events of its own.
    std::uint32_t unannounced_callback = kNone;
    Time timestamp{}, release{};  ///< Stated of the next job.
    std::vector<Job> open;        ///< The innermost last.
    bool waited = false, waits = false;
    std::set<std::uint32_t> apart;   ///< Threads of its process that waited meanwhile: of other executors.
    std::uint32_t taken_by = kNone;  ///< Subscription whose sample it holds.
    Sample taken;
    std::uint64_t message = 0, publication = 0;
    std::uint32_t publisher = kNone, topic = kNone;  ///< Of the latest publication.
    std::vector<std::uint32_t> reached;              ///< Subscriptions that it reached within the process.
    bool intra_published = false;                    ///< The same call may also publish between processes.
  };

  /// The handler of each event of the table.
#define HOTPATH_HANDLER(kind, ...) void on_##kind(const Event& e);
  HOTPATH_EVENTS(HOTPATH_HANDLER)
#undef HOTPATH_HANDLER

  // entities.cpp: nodes, topics and callbacks.
  /// Subscriptions that the new one shows to have ended, surely or perhaps.
  void replace_subscriptions(const Event& e, const Callback& by);
  /// The endpoint behind the handle of the middleware (0: none), which is new or was created just before.
  Endpoint& endpoint(const Event& e, Endpoint::Kind kind, std::uint64_t rmw_handle);
  void begin_timer(Handle callback, Timer& timer, std::uint32_t index);
  std::uint32_t add_callback(CallbackKind kind);
  void set_handle(Handle callback, std::uint32_t index);
  template <class Ended>
  void end_subscriptions(Topic& topic, const Ended& ended);
  [[nodiscard]] bool bounded() const { return most_entities_ > 0; }
  [[nodiscard]] bool full();
  /// Services and topics may have one name.
  std::uint32_t topic_named(const std::string& name, bool of_service = false);
  ThreadState& thread_of(const Event& e);

  void close(const Event& e, ThreadState& thread);
  void give_up(std::vector<Job>& open, std::size_t from);

  // unannounced.cpp: jobs of clients and waitables.
  void announce(const Event& e);
  void begin_unannounced(const Event& e, ThreadState& thread);
  void begin_unannounced(ThreadState& thread, std::uint32_t callback, Time at, std::uint64_t event,
                         std::optional<Response> response);
  std::uint32_t client_callback(std::uint32_t client);
  std::uint32_t pseudo_node(std::uint32_t process);
  std::uint32_t unannounced_callback(std::uint32_t node, const std::string& topic);
  void respond(const Event& e, Job& job);
  std::optional<Response> take_response(std::uint32_t process, std::uint32_t client,
                                        const std::set<std::uint32_t>& apart = {});

  // samples.cpp: matches the samples of jobs with publications.
  void publish(const Event& e, bool intra_process);
  void deliver(const Event& e, std::uint32_t subscription, const ThreadState& thread,
               std::optional<std::uint64_t> slot);
  void overflow(std::uint32_t subscription);
  void stamp(const ThreadState& thread, std::uint64_t source_ns);
  void take(const Event& e, std::uint32_t subscription, std::uint64_t source_ns);
  void hold(ThreadState& thread, std::uint32_t subscription, const std::deque<Unread>::iterator& sample);
  /// A sample without a traced publication.
  Sample stranger(std::uint32_t subscription, Time published);
  std::uint32_t subscription_behind(Handle buffer) const;

  /// All that is known by address.
  auto by_address() {
    return std::tie(nodes_, subscriptions_, rmw_subscriptions_, rclcpp_subscriptions_, callbacks_,
                    rclcpp_callbacks_, ipb_of_buffer_, subscription_of_ipb_, publishers_, endpoints_, timers_,
                    services_, service_callbacks_, clients_, executors_);
  }

  template <class T>
  static T find(const ByHandle<T>& all, Handle handle, T otherwise) {
    const auto at = all.find(handle);
    return at == all.end() ? otherwise : at->second;
  }

  Sink& sink_;
  const std::size_t most_entities_;
  System system_;
  ByHandle<std::uint32_t> nodes_, subscriptions_, rmw_subscriptions_, rclcpp_subscriptions_, callbacks_;
  ByHandle<std::uint64_t> rclcpp_callbacks_, ipb_of_buffer_, subscription_of_ipb_;
  ByHandle<std::uint32_t> publishers_;  // to endpoints
  ByHandle<std::uint32_t> endpoints_;   // by the middleware's handle; initialised by it, not yet by rcl
  ByHandle<Timer> timers_;
  ByHandle<Service> services_;
  ByHandle<std::uint32_t> service_callbacks_, clients_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> clients_of_;           // by service
  std::unordered_map<std::uint32_t, std::deque<Response>> responses_;                  // by process
  std::unordered_map<std::uint32_t, std::uint32_t> waiting_threads_;                   // number, by process
  std::unordered_map<std::uint32_t, std::uint32_t> pseudo_nodes_;                      // by process
  std::unordered_map<std::uint32_t, std::uint32_t> unannounced_;                       // callbacks, by topic
  ByHandle<std::uint32_t> executors_;                                                  // to the stated ones
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint32_t> callback_of_task_;  // by stated executor
  std::map<std::pair<bool, std::string>, std::uint32_t> topics_;                       // of services: true
  ByHandle<std::uint32_t> thread_indices_;                                             // by process and id
  std::vector<ThreadState> threads_;            // parallel to those of the system
  std::vector<std::uint32_t> free_threads_;     // indices
  std::vector<CallbackState> callback_states_;  // parallel to its callbacks
  /// Callbacks of timers that have ended, by node and period.
  std::map<std::pair<std::uint32_t, Duration>, std::vector<std::uint32_t>> ended_timers_;
  std::size_t unknown_ = 0;  // callbacks
  std::uint64_t publications_ = 0, events_ = 0;
};

}  // namespace hotpath::tracing
