// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/tracing/event.hpp"

namespace hotpath::tracing {

/// A trace that cannot be read; the message names the remedy. Other failures, of a disk or the
/// library, are std::runtime_error.
struct TraceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Facts about a trace beside its events.
struct TraceReading {
  std::map<std::string, std::uint64_t> events;  ///< By full name, `ros2:callback_start`.
  std::uint64_t all_events = 0;
  std::uint64_t discarded_events = 0;   ///< Least number of events for which the tracer had no room.
  std::uint64_t discarded_packets = 0;  ///< Groups of events that were overwritten.
  std::string broken_off;               ///< Why reading stopped before the end; empty: it did not.
  Time first{}, last{};
  Duration longest_gap{};  ///< Longest time without any event.
  Time gap_begin{};

  [[nodiscard]] Duration length() const { return last - first; }
};

/// The CTF 1.8 traces at or below a folder. libbabeltrace2 rejects a stream file of LTTng that ends
/// within a packet, as after a power loss or on a full disk. The folders of these files are replaced
/// by temporary copies without the incomplete packets.
class CtfTrace {
 public:
  /// Throws TraceError if there is no trace, or one in another format; std::runtime_error if a copy
  /// cannot be written.
  explicit CtfTrace(const std::filesystem::path& folder);
  CtfTrace(const CtfTrace&) = delete;
  CtfTrace& operator=(const CtfTrace&) = delete;
  ~CtfTrace();

  /// Reads all traces with libbabeltrace2, merged by time, and passes the assembled kinds of events
  /// to `visit`. Memory does not grow with the trace. Of a trace that breaks off the readable part is
  /// visited, and TraceReading::broken_off gives the reason. Throws TraceError if no event can be
  /// read, std::runtime_error in a build without libbabeltrace2, and exceptions of `visit`.
  [[nodiscard]] TraceReading read(const std::function<void(const Event&)>& visit) const;

 private:
  CtfTrace() = default;
  std::filesystem::path copy(const std::filesystem::path& folder);

  std::vector<std::filesystem::path> folders_, copies_;
  std::string cut_;  // where the trace was cut; empty: it was complete
};

/// Writes events, which are in the order of time and have a processor each, as a CTF 1.8 trace into
/// a new folder, with libbabeltrace2: one stream per processor, and LTTng's contexts vpid, vtid and
/// procname with each event. Throws std::runtime_error.
void write_ctf(const std::filesystem::path& folder, std::span<const Event> events,
               const std::string& process_name);

}  // namespace hotpath::tracing
