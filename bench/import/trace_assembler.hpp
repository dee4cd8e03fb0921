// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <string>
#include <unordered_map>
#include <vector>

#include "import/recorded_system.hpp"
#include "import/trace_events.hpp"

namespace hotpath {

/// Assembles entities and jobs from the events of a trace. A job lasts from the start to the end of
/// a callback on one thread. Its sample is the last one that the thread took before. The sample
/// comes from the publication with the same source timestamp; where publications have none
/// (Humble), from the nearest one. Memory is bounded by entities, open jobs and unread samples.
class TraceAssembler final : public TraceVisitor {
 public:
  explicit TraceAssembler(RecordedJobSink& sink) : sink_(sink) {}

  void visit(const TraceEvent& event) override;
  /// At the end of the trace: passes open jobs and unread samples to the sink.
  void finish();

  [[nodiscard]] const RecordedSystem& system() const { return system_; }

 private:
  /// Most unread samples of a subscription that keeps all.
  static constexpr std::size_t kKeepAll = 1000;

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
  struct Unread {
    RecordedSample sample;
    std::uint64_t publication = 0;
    std::uint64_t source_ns = 0;  ///< 0: the publication has no timestamp.
    std::uint64_t slot = 0;       ///< Intra-process: place in the ring buffer.
    bool intra_process = false;
  };
  struct Readers {
    std::deque<Unread> unread;
    std::uint64_t sequence = 0;
  };
  /// The state of a thread.
  struct Thread {
    std::vector<RecordedJob> open;  ///< The innermost last.
    bool waited = false;
    std::uint32_t taken_by = kNone;  ///< Subscription whose sample it holds.
    RecordedSample taken;
    std::uint64_t message = 0, publisher = 0, publication = 0;
    std::uint32_t topic = kNone;
    bool intra_published = false;  ///< The same call may also publish between processes.
  };

  /// Handles an event that describes the system; false: it is another kind of event.
  bool describe(const TraceEvent& e);
  void node(const TraceEvent& e);
  void publisher(const TraceEvent& e);
  void subscription(const TraceEvent& e);
  void subscription_callback(const TraceEvent& e);
  void timer_callback(const TraceEvent& e);
  void link(const TraceEvent& e);
  void add_callback(Handle callback, std::uint32_t index);
  void start(const TraceEvent& e);
  void end(const TraceEvent& e);
  void publish(const TraceEvent& e, bool intra_process);
  void deliver(const TraceEvent& e, std::uint32_t subscription, const Thread& thread, bool intra_process);
  void stamp(const TraceEvent& e);
  /// `subscriptions` maps the event's first number to a subscription.
  void take(const TraceEvent& e, const ByHandle<std::uint32_t>& subscriptions);
  void enqueue(const TraceEvent& e);
  void dequeue(const TraceEvent& e);
  void hold(Thread& thread, std::uint32_t subscription, const std::deque<Unread>::iterator& sample);
  void give_up(RecordedJob& job);

  std::uint32_t node_of(Handle handle) const;
  std::uint32_t topic_named(std::string_view name);
  std::uint32_t thread_index(const TraceEvent& e);
  std::uint32_t subscription_behind(std::uint32_t process, std::uint64_t buffer) const;

  RecordedJobSink& sink_;
  RecordedSystem system_;
  ByHandle<std::uint32_t> nodes_, subscriptions_, rmw_subscriptions_, callbacks_;
  ByHandle<Handle> rclcpp_subscriptions_;  // to the handle of rcl
  ByHandle<std::uint64_t> ipb_of_buffer_, subscription_of_ipb_;
  ByHandle<std::uint32_t> publishers_;  // to topics
  ByHandle<Timer> timers_;
  std::unordered_map<std::string, std::uint32_t> topics_;
  ByHandle<std::uint32_t> thread_indices_;  // by process and id
  std::vector<Thread> threads_;             // parallel to those of the system
  std::vector<Readers> readers_;            // parallel to its callbacks
  std::vector<std::uint64_t> numbers_;      // of jobs begun, parallel to its callbacks
  std::uint64_t publications_ = 0, events_ = 0;
};

}  // namespace hotpath
