// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
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
  explicit Assembler(Sink& sink) : sink_(sink) {}

  /// The next event in the order of time. A job that it ends is passed to the sink.
  void event(const Event& e);
  /// Forgets a thread that has ended, unless a job of it is open. Its place in the system is free for
  /// another thread, and has the id 0 until then.
  void forget_thread(std::uint32_t process, std::uint32_t thread);
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
    std::uint64_t source_ns = 0;        ///< 0: the publication has no timestamp.
    std::optional<std::uint64_t> slot;  ///< Intra-process: place in the ring buffer.
  };
  struct CallbackState {
    std::deque<Unread> unread;
    std::uint64_t samples = 0, jobs = 0;  ///< Next numbers.
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
    bool waited = false;
    std::uint32_t taken_by = kNone;  ///< Subscription whose sample it holds.
    Sample taken;
    std::uint64_t message = 0, publisher = 0, publication = 0;
    std::uint32_t topic = kNone;
    bool intra_published = false;  ///< The same call may also publish between processes.
  };

  // entities.cpp: events that create nodes, topics and callbacks.
  void describe(const Event& e);
  void add_node(const Event& e);
  void add_publisher(const Event& e);
  void add_subscription(const Event& e);
  void add_rclcpp_subscription(Handle rclcpp, std::uint32_t subscription);
  /// The endpoint behind the handle of the middleware (0: none), which is new or was created just before.
  Endpoint& endpoint(const Event& e, Endpoint::Kind kind, std::uint64_t rmw_handle);
  void add_timer_callback(const Event& e);
  void add_service_callback(const Event& e);
  std::uint32_t add_callback(CallbackKind kind);
  void set_handle(Handle callback, std::uint32_t index);
  /// Services and topics may have one name.
  std::uint32_t topic_named(const std::string& name, bool of_service = false);
  ThreadState& thread_of(const Event& e);

  // stated_executors.cpp: events of executors that describe themselves.
  void state(const Event& e);
  void state_callback(const Event& e, std::uint32_t executor);
  void state_job(const Event& e, std::uint32_t executor);

  void start(const Event& e);
  void end(const Event& e);
  void close(const Event& e, ThreadState& thread);
  void give_up(std::vector<Job>& open, std::size_t from);

  // unannounced.cpp: jobs of clients and waitables.
  void add_client(const Event& e);
  void ask(const Event& e);
  void announce(const Event& e);
  void begin_unannounced(const Event& e, ThreadState& thread);
  void begin_unannounced(ThreadState& thread, std::uint32_t callback, Time at, std::uint64_t event,
                         std::optional<Response> response);
  std::uint32_t client_callback(std::uint32_t client);
  std::uint32_t pseudo_node(std::uint32_t process);
  std::uint32_t unannounced_callback(std::uint32_t node, const std::string& topic);
  void respond(const Event& e, Job& job);
  std::optional<Response> take_response(std::uint32_t process, std::uint32_t client);

  // samples.cpp: events that match the samples of jobs with publications.
  void publish(const Event& e, bool intra_process);
  void deliver(const Event& e, std::uint32_t subscription, const ThreadState& thread,
               std::optional<std::uint64_t> slot);
  void stamp(const ThreadState& thread, std::uint64_t source_ns);
  void take(const Event& e, std::uint32_t subscription, std::uint64_t source_ns);
  void enqueue(const Event& e);
  void dequeue(const Event& e);
  void hold(ThreadState& thread, std::uint32_t subscription, const std::deque<Unread>::iterator& sample);
  /// A sample without a traced publication.
  Sample stranger(std::uint32_t subscription, Time published);
  std::uint32_t subscription_behind(Handle buffer) const;

  template <class T>
  static T find(const ByHandle<T>& all, Handle handle, T otherwise) {
    const auto at = all.find(handle);
    return at == all.end() ? otherwise : at->second;
  }

  Sink& sink_;
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
  std::uint64_t publications_ = 0, events_ = 0;
};

}  // namespace hotpath::tracing
