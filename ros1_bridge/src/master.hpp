// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace hotpath {

struct HostAndPort {
  std::string host, port;
};

/// Of `http://host:port`, with or without a slash at the end. Throws std::invalid_argument that says what is
/// wrong.
HostAndPort parse_uri(const std::string& uri);

/// Whether somebody accepts connections there. A call of roscpp would wait for ever for a machine that does
/// not answer.
bool accepts_connections(const HostAndPort& where, std::chrono::milliseconds time_out);

}  // namespace hotpath
