// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <deque>
#include <filesystem>
#include <list>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hotpath/tracing/ctf_trace.hpp"
#include "hotpath/tracing/event.hpp"
#include "program/whole_file.hpp"

namespace hotpath::watch {

/// Whether the event describes a node, publisher, callback or executor.
[[nodiscard]] inline bool describes(tracing::EventKind kind) {
  return tracing::format_of(kind).role == tracing::EventRole::describes;
}

/// Keeps the last events of a running system, and the events that describe its nodes, publishers and
/// callbacks, for a trace that can be imported: of an address that is used again, the last ones. The
/// texts of events must outlive it.
class FlightRecorder {
 public:
  explicit FlightRecorder(tracing::Duration length) : length_(length) {}

  /// The next event in the order of time.
  void keep(const tracing::Event& event) {
    if (describes(event.kind)) {
      const Described what(event.process, event.kind, event.number[0], event.number[1]);
      if (descriptions_.size() == kMostDescriptions && !described_.contains(what)) return;
      const auto [at, is_new] = described_.try_emplace(what);
      if (!is_new) descriptions_.erase(at->second);
      at->second = descriptions_.insert(descriptions_.end(), event);
      return;
    }
    recent_.push_back(event);
    while (recent_.front().at + length_ < event.at || recent_.size() > kMost) recent_.pop_front();
    while (!incidents_.empty() && incidents_.front().first + length_ < event.at) incidents_.pop_front();
  }

  /// Marks an incident that began at this instant, or at the beginning of the kept events.
  void mark(tracing::Time at, const std::string& sentence) { incidents_.emplace_back(at, sentence); }

  /// The kept events in the order of time. Descriptions that are older than the kept jobs move to the
  /// beginning. The creation of a timer moves by whole periods, which keeps its timestamps.
  [[nodiscard]] std::vector<tracing::Event> events() const {
    std::vector<tracing::Event> events(descriptions_.begin(), descriptions_.end());
    // Readers merge the streams of processors by time alone.
    const tracing::Time before =
        recent_.empty() ? tracing::Time{} : recent_.front().at - tracing::Duration(1);
    for (tracing::Event& event : events) {
      if (event.at >= before) continue;
      event.processor = 0;
      const tracing::Duration period(static_cast<std::int64_t>(event.number[1]));
      if (event.kind != tracing::EventKind::timer_init || period <= tracing::Duration::zero()) {
        event.at = before;
      } else {
        event.at += (before - event.at) / period * period;
      }
    }
    events.insert(events.end(), recent_.begin(), recent_.end());
    for (const auto& [at, sentence] : incidents_) {
      tracing::Event& event = events.emplace_back();
      event.kind = tracing::EventKind::incident;
      event.at = std::max(at, before + tracing::Duration(1));
      event.text[0] = sentence.c_str();
    }
    std::ranges::stable_sort(events, {}, &tracing::Event::at);
    for (tracing::Event& event : events) event.processor = std::max(event.processor, 0);  // -1: unknown
    return events;
  }
  /// Writes a trace (CTF 1.8) into a new folder. Throws RunError.
  void write(const std::filesystem::path& folder) const {
    const std::vector<tracing::Event> kept = events();
    program::write_whole_folder(
        folder, [&](const std::filesystem::path& part) { tracing::write_ctf(part, kept, "watched"); });
  }

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
