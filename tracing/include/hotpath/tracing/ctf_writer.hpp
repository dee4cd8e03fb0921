// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "hotpath/tracing/event.hpp"

namespace hotpath::tracing {

/// Writes events, which are in the order of time and have a processor each, as a CTF 1.8 trace into
/// a new folder, with libbabeltrace2: one stream per processor, and LTTng's contexts vpid, vtid and
/// procname with each event. Throws std::runtime_error.
void write_ctf(const std::filesystem::path& folder, std::span<const Event> events,
               const std::string& process_name);

}  // namespace hotpath::tracing
