// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

#include "hotpath/core/job.hpp"
#include "hotpath/live/sample.hpp"

namespace hotpath {

/// Where arriving samples go: the executor. Called from any thread, also from within a publication by one of
/// the executor's own jobs, so it only enqueues.
class SampleSink {
 public:
  virtual void deliver(TaskId task, const SampleInfo& info, Sample sample) = 0;

 protected:
  ~SampleSink() = default;
};

/// A transport cannot do its work: the message says what failed and what to do.
struct TransportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What is done once to each message of a transport before its first use: takes the memory that it will need.
template <class Message>
using PrepareMessage = std::function<void(Message&)>;

/// Carries messages from writers to readers. Endpoints are added before the run starts. Readers hand every
/// sample to their sink at once: the history of unread samples lives in the executor, under the same lock as
/// the scheduler's count of it.
template <class Message>
class Transport {
 public:
  using WriterId = std::uint32_t;
  virtual ~Transport() = default;

  /// `depth`: history depth, >= 1. `readers`: how many readers the graph has for this topic, in all
  /// processes.
  virtual WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t readers) = 0;
  /// `writers`: how many writers the graph has for this topic, in all processes.
  virtual void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t writers,
                          SampleSink& sink) = 0;
  /// Waits until every endpoint has met all its partners. Throws TransportError that names one that has not
  /// by then.
  virtual void wait_until_matched(Time deadline) = 0;

  /// Samples that came from outside of the run, or that nobody in it can have published, and were left out.
  /// Any thread.
  [[nodiscard]] virtual std::uint64_t refused() const { return 0; }

  /// A message to fill, whose content is undefined; goes back by publish().
  virtual Message& borrow(WriterId writer) = 0;
  /// Returns when the sample has been handed over (synchronous publishing).
  virtual void publish(WriterId writer, Message& message, const SampleInfo& info) = 0;
};

}  // namespace hotpath
