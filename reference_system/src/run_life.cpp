// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/run_life.hpp"

#include <algorithm>
#include <map>

namespace hotpath {

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

Duration RunLife::cpu_time(const rusage& usage) {
  return std::chrono::seconds(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         std::chrono::microseconds(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

std::string RunLife::as_text(const std::vector<WorkerThread>& workers) {
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
  return joined(texts, ", ");
}

bool RunLife::timers_are_ordinary(const std::vector<WorkerThread>& workers) {
  return std::any_of(workers.begin(), workers.end(), [](const WorkerThread& w) {
    return w.role == WorkerRole::timer_management && w.policy == ThreadPolicy{};
  });
}

}  // namespace hotpath
