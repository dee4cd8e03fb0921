// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/run_channel.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "hotpath/live/clock.hpp"

namespace hotpath {

void ChannelMessage::set_text(const std::string& s) {
  text.fill('\0');
  std::memcpy(text.data(), s.data(), std::min(s.size(), text.size() - 1));
}

Channel& Channel::operator=(Channel&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

Channel::~Channel() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::array<Channel, 2> Channel::make_pair() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "cannot create a socket pair");
  }
  return {Channel(ends[0]), Channel(ends[1])};
}

int Channel::for_program() const {
  fcntl(descriptor_, F_SETFD, 0);
  return descriptor_;
}

bool Channel::send(const ChannelMessage& message) const {
  ssize_t sent = 0;
  do {
    sent = ::send(descriptor_, &message, sizeof(message), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == sizeof(message);
}

std::optional<ChannelMessage> Channel::receive(Time until) const {
  const Duration left = std::max(until - now(), Duration::zero());
  const timespec wait{std::chrono::floor<std::chrono::seconds>(left).count(),
                      (left % std::chrono::seconds(1)).count()};
  pollfd p{descriptor_, POLLIN, 0};
  if (ppoll(&p, 1, &wait, nullptr) <= 0) return std::nullopt;
  ChannelMessage message(ChannelMessage::Kind::closed);
  const ssize_t received = recv(descriptor_, &message, sizeof(message), MSG_TRUNC);
  if (received < 0 && errno == EINTR) return std::nullopt;
  if (received == sizeof(message)) return message;
  if (received > 0) return ChannelMessage(ChannelMessage::Kind::failed, {}, kOtherLayout);
  return ChannelMessage(ChannelMessage::Kind::closed);
}

ForkedProcess fork_process(const std::function<int(const Channel&)>& work) {
  auto [ours, theirs] = Channel::make_pair();
  const pid_t id = fork();
  if (id == 0) {
    ours = Channel();
    _exit(work(theirs));
  }
  return {id, std::move(ours)};
}

}  // namespace hotpath
