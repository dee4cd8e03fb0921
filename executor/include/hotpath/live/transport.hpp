// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// The owner of lent samples, to which they return. Called from any thread, never under the
/// executor's lock.
class SampleOwner {
 public:
  virtual void give_back(const void* data, std::uintptr_t token) noexcept = 0;
  /// Lends a lent sample once more: it will be returned twice.
  virtual void lend_again(std::uintptr_t token) noexcept = 0;

 protected:
  ~SampleOwner() = default;
};

/// One received message, lent by a transport until this handle is destroyed. Move-only; no allocation.
class Sample {
 public:
  Sample() = default;
  Sample(const void* data, SampleOwner& owner, std::uintptr_t token) : data_(data, Loan{&owner, token}) {}

  void reset() noexcept { data_.reset(); }
  explicit operator bool() const { return data_ != nullptr; }
  /// Returns another handle to the same message. This handle must hold one.
  [[nodiscard]] Sample share() const noexcept {
    const auto& [owner, token] = data_.get_deleter();
    owner->lend_again(token);
    return {data_.get(), *owner, token};
  }
  template <class Message>
  [[nodiscard]] const Message& as() const {
    return *static_cast<const Message*>(data_.get());
  }

 private:
  struct Loan {
    SampleOwner* owner;
    std::uintptr_t token;
    void operator()(const void* data) const noexcept { owner->give_back(data, token); }
  };
  std::unique_ptr<const void, Loan> data_;
};

/// The destination of arriving samples: the executor. Called from any thread, also from within a
/// publication by one of the executor's own jobs; therefore it only enqueues.
class SampleSink {
 public:
  virtual void deliver(TaskId task, const SampleInfo& info, Sample sample) = 0;
  /// A sample was rejected: from outside the run, or impossible for any of its publishers.
  virtual void rejected() {}

 protected:
  ~SampleSink() = default;
};

/// A transport failed; the message states the failure and the remedy.
struct TransportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Prepares each message of a transport once before its first use, for example by reserving its
/// memory.
template <class Message>
using PrepareMessage = std::function<void(Message&)>;

/// Carries messages from writers to readers. Endpoints are added before the run starts. Readers
/// pass every sample to their sink at once: the executor holds the history of unread samples, under
/// the same lock as the scheduler's count of them.
template <class Message>
class Transport {
 public:
  using WriterId = std::uint32_t;
  virtual ~Transport() = default;

  /// `depth`: history depth, >= 1. `readers`: the number of the topic's readers in the graph,
  /// across all processes.
  virtual WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t readers) = 0;
  /// `writers`: the number of the topic's writers in the graph, across all processes.
  virtual void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t writers,
                          SampleSink& sink) = 0;
  /// Waits until every endpoint is matched with all its partners. Throws TransportError with an
  /// unmatched endpoint if `deadline` passes.
  virtual void wait_until_matched(Time deadline) = 0;

  /// Returns a message to fill, with undefined content; publish() takes it back.
  virtual Message& borrow(WriterId writer) = 0;
  /// Publishes synchronously: returns after the sample has been handed over.
  virtual void publish(WriterId writer, Message& message, const SampleInfo& info) = 0;
};

}  // namespace hotpath
