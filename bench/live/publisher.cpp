// SPDX-License-Identifier: Apache-2.0
#include "live/publisher.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "program/child_process.hpp"

#include "hotpath/live/clock.hpp"

namespace hotpath {

namespace {

using Kind = ChannelMessage::Kind;

/// It gets little of a busy processor, and flushes for a second.
constexpr Duration kTimeToEnd = std::chrono::seconds(5);

}  // namespace

bool Publisher::receive(Kind kind, Time limit) {
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

void Publisher::await_ready(Time limit) { receive(Kind::matched, limit); }

void Publisher::begin(Time epoch, Time end) {
  channel_.send(ChannelMessage(Kind::begin, {to_ns(epoch), to_ns(end)}));
}

void Publisher::stop(Time end) { channel_.send(ChannelMessage(Kind::stop, {to_ns(end)})); }

std::string Publisher::cause_of_end() {
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
  return status == 0 ? "" : "its process " + how_it_ended(status);
}

void Publisher::finish(std::vector<std::string>& warnings) {
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
