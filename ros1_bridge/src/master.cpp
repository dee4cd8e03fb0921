// SPDX-License-Identifier: Apache-2.0
#include "master.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <regex>
#include <stdexcept>

namespace hotpath {

namespace {

bool connects(const addrinfo& address, std::chrono::milliseconds time_out) {
  const int connection =
      socket(address.ai_family, address.ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, address.ai_protocol);
  if (connection < 0) return false;
  int error = connect(connection, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  pollfd poll_for{connection, POLLOUT, 0};
  if (error == EINPROGRESS && poll(&poll_for, 1, static_cast<int>(time_out.count())) == 1) {
    socklen_t size = sizeof error;
    getsockopt(connection, SOL_SOCKET, SO_ERROR, &error, &size);
  }
  close(connection);
  return error == 0;
}

}  // namespace

HostAndPort parse_uri(const std::string& uri) {
  static const std::regex kForm("http://([^/:]+):([0-9]{1,5})/?");
  std::smatch parts;
  if (!std::regex_match(uri, parts, kForm))
    throw std::invalid_argument("`" + uri + "` is no ROS_MASTER_URI; usually it is http://localhost:11311");
  return {parts[1], parts[2]};
}

bool accepts_connections(const HostAndPort& where, std::chrono::milliseconds time_out) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(where.host.c_str(), where.port.c_str(), &hints, &found) != 0) return false;
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
  for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
    if (connects(*address, time_out)) return true;
  }
  return false;
}

}  // namespace hotpath
