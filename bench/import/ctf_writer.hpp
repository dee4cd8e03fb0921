// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hotpath {

enum class FieldType : std::uint8_t { address, integer, text };

/// A class of events to write.
struct WrittenFormat {
  const char* name;
  struct Field {
    const char* name;
    FieldType type;
  };
  std::vector<Field> fields;  ///< As many as an event has values, at most.
};

struct WrittenEvent {
  std::int64_t at_ns = 0;
  std::uint32_t format = 0;  ///< Index.
  std::uint16_t processor = 0;
  std::uint32_t process = 0, thread = 0;
  std::array<std::uint64_t, 5> values = {};  ///< By field; for a text its index.
};

/// The content of a trace, with its events in the order of time.
struct WrittenTrace {
  std::vector<WrittenFormat> formats;
  std::vector<std::string> texts;
  std::vector<WrittenEvent> events;
  std::string process_name;
};

/// Writes a CTF 1.8 trace with libbabeltrace2 into a new folder: one stream per processor, and
/// LTTng's contexts vpid, vtid and procname with each event. Throws RunError.
void write_ctf(const std::filesystem::path& folder, const WrittenTrace& trace);

}  // namespace hotpath
