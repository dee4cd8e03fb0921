// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bounded_queue.hpp"
#include "event.hpp"

namespace hotpath {

struct TelemetryOptions {
  std::uint32_t domain = 0;     ///< DDS domain, 0 to 232.
  bool all_interfaces = false;  ///< False: only this machine's loopback.
};

/// Receives a benchmark's telemetry from Fast DDS. Its listeners run in Fast DDS threads and only
/// enqueue, at most 4096 samples and 64 MiB.
class TelemetryInput {
 public:
  /// Throws std::runtime_error if Fast DDS cannot create an entity.
  explicit TelemetryInput(const TelemetryOptions& options);
  ~TelemetryInput();
  TelemetryInput(const TelemetryInput&) = delete;
  TelemetryInput& operator=(const TelemetryInput&) = delete;

  std::optional<Event> pop(std::chrono::steady_clock::time_point deadline) { return queue_.pop(deadline); }

  /// Reads these topics of the graph (DDS names, best effort) instead of the previous topics.
  void read_points(const std::vector<std::string>& topics);

  /// Number of benchmarks now in the domain.
  std::int32_t benchmarks() const;

  struct Counts {
    std::uint64_t received = 0;
    std::uint64_t dropped = 0;  ///< Dropped because the queue was full.
  };
  Counts counts(std::size_t stream) const;

  /// New messages about conflicts in this domain, each reported once.
  std::vector<std::string> take_complaints();

 private:
  struct Dds;
  struct Counters {
    std::atomic<std::uint64_t> received{0}, dropped{0};
  };

  void enqueue(Event event);
  void complain(const std::string& text);

  BoundedQueue<Event> queue_{4096, 64 << 20};
  std::array<Counters, std::variant_size_v<Event>> counters_;
  std::mutex mutex_;
  std::set<std::string> known_complaints_;
  std::vector<std::string> new_complaints_;
  std::unique_ptr<Dds> dds_;  // declared last: its threads use the members above
};

}  // namespace hotpath
