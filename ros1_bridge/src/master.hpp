// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace hotpath {

/// Longest wait for an answer of the master, and time between two looks whether it is there.
inline constexpr std::chrono::milliseconds kMasterTimeOut{1000}, kMasterPoll{500};

struct HostAndPort {
  std::string host, port;
};

/// Parses `http://host:port`, with or without a trailing slash. Throws std::invalid_argument with a
/// description of the error.
HostAndPort parse_uri(const std::string& uri);

/// Whether a server accepts connections there. A roscpp call would wait for ever for a machine that
/// does not answer.
bool accepts_connections(const HostAndPort& where, std::chrono::milliseconds time_out);

}  // namespace hotpath
