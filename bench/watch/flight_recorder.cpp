// SPDX-License-Identifier: Apache-2.0
#include "watch/flight_recorder.hpp"

#include <algorithm>

#include "hotpath/tracing/ctf_writer.hpp"
#include "program/whole_file.hpp"

namespace hotpath::watch {

using tracing::Event;
using K = tracing::EventKind;

bool describes(K kind) {
  return kind < K::callback_start || kind == K::buffer_to_ipb || kind == K::ipb_to_subscription ||
         kind == K::executor_init;
}

void FlightRecorder::keep(const Event& event) {
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

std::vector<Event> FlightRecorder::events() const {
  std::vector<Event> events(descriptions_.begin(), descriptions_.end());
  // Readers merge the streams of processors by time alone.
  const tracing::Time before = recent_.empty() ? tracing::Time{} : recent_.front().at - tracing::Duration(1);
  for (Event& event : events) {
    if (event.at >= before) continue;
    event.processor = 0;
    const tracing::Duration period(static_cast<std::int64_t>(event.number[1]));
    if (event.kind != K::timer_init || period <= tracing::Duration::zero()) {
      event.at = before;
    } else {
      event.at += (before - event.at) / period * period;
    }
  }
  events.insert(events.end(), recent_.begin(), recent_.end());
  for (const auto& [at, sentence] : incidents_) {
    Event& event = events.emplace_back();
    event.kind = K::incident;
    event.at = std::max(at, before + tracing::Duration(1));
    event.text[0] = sentence.c_str();
  }
  std::ranges::stable_sort(events, {}, &Event::at);
  for (Event& event : events) event.processor = std::max(event.processor, 0);  // -1: unknown
  return events;
}

void FlightRecorder::write(const std::filesystem::path& folder) const {
  const std::vector<Event> kept = events();
  program::write_whole_folder(
      folder, [&](const std::filesystem::path& part) { tracing::write_ctf(part, kept, "watched"); });
}

}  // namespace hotpath::watch
