// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/run_channel.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
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

std::optional<ChannelMessage> RunLife::receive(Time limit) const {
  auto message = coordinator_.receive(limit);
  if (message && message->kind == Kind::closed) throw CoordinatorGone();
  return message;
}

ChannelMessage RunLife::expect(Kind kind) const {
  for (;;) {
    const auto message = receive(now() + std::chrono::hours(1));
    if (message && message->kind == kind) return *message;
  }
}

void RunLife::tell(const ChannelMessage& message) const {
  if (!coordinator_.send(message)) throw CoordinatorGone();
}

rusage RunLife::own_usage() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

ChannelMessage RunLife::begun(const std::vector<WorkerThread>& workers) {
  constexpr std::size_t kMostOneByOne = 8;
  std::vector<std::string> texts;
  std::map<std::string, int> counts;
  for (const WorkerThread& worker : workers) {
    texts.push_back(to_string(worker));
    ++counts[texts.back()];
  }
  if (texts.size() > kMostOneByOne) {
    texts.clear();
    for (const auto& [worker, count] : counts) texts.push_back(std::to_string(count) + " x " + worker);
  }
  const bool ordinary_timers = std::ranges::any_of(workers, [](const WorkerThread& w) {
    return w.role == WorkerRole::timer_management && w.policy == ThreadPolicy{};
  });
  return {Kind::begun, {ordinary_timers}, joined(texts, ", ")};
}

ChannelMessage RunLife::done(const rusage& before, const rusage& after) {
  const auto cpu_time = [](const rusage& usage) -> Duration {
    return std::chrono::seconds(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           std::chrono::microseconds(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  };
  ChannelMessage usage(Kind::done);
  usage.number[ChannelMessage::cpu_time_ns] = (cpu_time(after) - cpu_time(before)).count();
  usage.number[ChannelMessage::peak_memory_kib] = after.ru_maxrss;
  usage.number[ChannelMessage::voluntary_switches] = after.ru_nvcsw - before.ru_nvcsw;
  usage.number[ChannelMessage::involuntary_switches] = after.ru_nivcsw - before.ru_nivcsw;
  return usage;
}

}  // namespace hotpath
