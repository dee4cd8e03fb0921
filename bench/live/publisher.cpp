// SPDX-License-Identifier: Apache-2.0
#include "live/publisher.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

using Kind = ChannelMessage::Kind;

/// It gets little of a busy processor, and flushes for a second.
constexpr Duration kTimeToEnd = std::chrono::seconds(5);

}  // namespace

bool LiveSender::receive(Kind kind, Time limit) {
  while (process_ > 0 && failure_.empty() && now() < limit) {
    bool closed = false;
    const auto message = channel_.receive(limit, closed);
    if (closed) return false;
    if (!message) continue;
    if (message->kind == Kind::failed) failure_ = message->text.data();
    if (message->kind == Kind::done) samples_lost_ = message->number[0];
    if (message->kind == kind) return true;
  }
  return false;
}

void LiveSender::await_ready(Time limit) { receive(Kind::matched, limit); }

void LiveSender::begin(Time epoch, Time end) {
  ChannelMessage message;
  message.kind = Kind::begin;
  message.number = {to_ns(epoch), to_ns(end)};
  channel_.send(message);
}

void LiveSender::stop(Time end) {
  ChannelMessage message;
  message.kind = Kind::stop;
  message.number = {to_ns(end)};
  channel_.send(message);
}

std::string LiveSender::cause_of_end() {
  if (process_ < 0) return "its process could not be started";
  int status = 0;
  const Time limit = now() + kTimeToEnd;
  while (waitpid(process_, &status, WNOHANG) == 0) {
    if (now() < limit) {
      usleep(1000);
      continue;
    }
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    return "its process did not end in time and was ended";
  }
  if (WIFSIGNALED(status))
    return std::string("its process was ended by a signal (") + strsignal(WTERMSIG(status)) + ")";
  return status == 0 ? "" : "its process ended too early";
}

void LiveSender::finish(std::vector<std::string>& warnings) {
  receive(Kind::done, now() + kTimeToEnd);
  const std::string cause = cause_of_end();
  if (failure_.empty()) failure_ = cause;
  if (!failure_.empty())
    warnings.push_back("Live publishing stopped (" + failure_ + "); the run itself went on.");
  if (samples_lost_ > 0) {
    warnings.push_back("Live publishing: " + std::to_string(samples_lost_) +
                       " chain samples may not have reached every reader, which was too slow.");
  }
}

}  // namespace hotpath
