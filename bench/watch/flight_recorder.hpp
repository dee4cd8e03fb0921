// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <list>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hotpath/tracing/event.hpp"

namespace hotpath::watch {

/// Whether the event describes a node, publisher or callback, instead of a job.
[[nodiscard]] bool describes(tracing::EventKind kind);

/// Keeps the last events of a running system, and the events that describe its nodes, publishers and
/// callbacks, for a trace that can be imported: of an address that is used again, the last ones. The
/// texts of events must outlive it.
class FlightRecorder {
 public:
  explicit FlightRecorder(tracing::Duration length) : length_(length) {}

  /// The next event in the order of time.
  void keep(const tracing::Event& event);

  /// Marks an incident that began at this instant, or at the beginning of the kept events.
  void mark(tracing::Time at, const std::string& sentence) { incidents_.emplace_back(at, sentence); }

  /// The kept events in the order of time. Descriptions that are older than the kept jobs move to the
  /// beginning. The creation of a timer moves by whole periods, which keeps its timestamps.
  [[nodiscard]] std::vector<tracing::Event> events() const;
  /// Writes a trace (CTF 1.8) into a new folder. Throws RunError.
  void write(const std::filesystem::path& folder) const;

 private:
  /// 250 MB.
  static constexpr std::size_t kMost = 3'000'000;
  static constexpr std::size_t kMostDescriptions = 200'000;
  /// Process, kind and addresses.
  using Described = std::tuple<std::uint32_t, tracing::EventKind, std::uint64_t, std::uint64_t>;

  const tracing::Duration length_;
  std::list<tracing::Event> descriptions_;
  std::map<Described, std::list<tracing::Event>::iterator> described_;
  std::deque<tracing::Event> recent_;
  std::deque<std::pair<tracing::Time, std::string>> incidents_;
};

}  // namespace hotpath::watch
