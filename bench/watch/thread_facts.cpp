// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_facts.hpp"

#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "hotpath/live/thread_setup.hpp"
#include "machine/proc_files.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

/// Between two searches for timer threads and threads that have ended.
constexpr Duration kSearch = std::chrono::seconds(1);
/// Between two readings of what the hypervisor withheld, as long as that is nothing. Otherwise each reading
/// has to explain what happened since the one before.
constexpr Duration kStolen = std::chrono::milliseconds(100);

std::string content_of(const std::string& path) {
  std::ostringstream content;
  content << std::ifstream(path).rdbuf();
  return content.str();
}

std::string folder_of(const ThreadKey& thread) {
  return program::concat("/proc/", thread.first, "/task/", thread.second);
}

bool lives(const ThreadKey& thread) { return access(folder_of(thread).c_str(), F_OK) == 0; }

/// Whether it has a name that hotpath's executors give to their timer threads, on rclcpp or of their own.
bool is_timer_thread(const ThreadKey& thread) {
  const std::string name = machine::first_line(folder_of(thread) + "/comm");
  return name == "hotpath_timers" || name == "timer_mgmt";
}

std::vector<int> processors_of(pid_t thread) {
  cpu_set_t set;
  std::vector<int> processors;
  if (sched_getaffinity(thread, sizeof set, &set) != 0) return processors;
  for (int p = 0; p < CPU_SETSIZE; ++p)
    if (CPU_ISSET(p, &set)) processors.push_back(p);
  return processors;
}

}  // namespace

bool parse_stat(const std::string& text, ThreadFacts& facts) {
  const std::size_t open = text.find('('), close = text.rfind(')');  // a name may contain both
  if (open == std::string::npos || close == std::string::npos || close < open) return false;
  facts.name = text.substr(open + 1, close - open - 1);
  std::istringstream rest(text.substr(close + 1));
  std::string field;
  constexpr int kStart = 22, kProcessor = 39;  // proc(5) counts fields from 1; the state is the third
  rest >> facts.state;
  for (int f = 4; f < kStart; ++f) rest >> field;
  rest >> facts.started;
  for (int f = kStart + 1; f < kProcessor; ++f) rest >> field;
  return static_cast<bool>(rest >> facts.processor);
}

bool parse_schedstat(const std::string& text, ThreadFacts& facts) {
  std::istringstream numbers(text);
  std::int64_t ran_ns = 0, waited_ns = 0;
  if (!(numbers >> ran_ns >> waited_ns)) return false;
  facts.ran = Duration(ran_ns);
  facts.waited = Duration(waited_ns);
  return true;
}

std::optional<ThreadFacts> ThreadReader::facts_of(const ThreadKey& thread) const {
  const std::string folder = folder_of(thread);
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0 || status.st_uid != geteuid()) return std::nullopt;
  ThreadFacts facts{thread.first, thread.second};
  const auto id = static_cast<pid_t>(thread.second);
  const auto policy = thread_policy(id);
  facts.processors = processors_of(id);
  if (!policy || facts.processors.empty() || !parse_stat(content_of(folder + "/stat"), facts) ||
      !parse_schedstat(content_of(folder + "/schedstat"), facts))
    return std::nullopt;
  facts.policy = *policy;
  if (const auto stolen = stolen_.find(facts.processor); stolen != stolen_.end())
    facts.stolen = stolen->second;
  return facts;
}

void ThreadReader::search(const tracing::System& system, std::vector<ThreadKey>& ended) {
  timer_threads_.clear();
  std::set<std::uint32_t> processes, known = system.processes;
  for (const tracing::Thread& thread : system.threads) {
    if (thread.id != 0) known.insert(thread.process);
    if (thread.jobs > 0) processes.insert(thread.process);
    if (thread.id != 0 && !lives(key_of(thread))) ended.push_back(key_of(thread));
  }
  for (const std::uint32_t process : known)
    if (!lives({process, process})) ended.emplace_back(process, 0);
  for (const std::uint32_t process : processes) {
    for (const std::string& id : machine::names_in(program::concat("/proc/", process, "/task"))) {
      const ThreadKey thread(process, std::atol(id.c_str()));
      if (is_timer_thread(thread)) timer_threads_.insert(thread);
    }
  }
}

ThreadReading ThreadReader::read(const tracing::System& system, Time at) {
  ThreadReading reading{at};
  if (at >= searched_ + kSearch) {
    searched_ = at;
    search(system, reading.ended);
  }
  const auto is_some = [](const auto& stolen) { return stolen.second > Duration::zero(); };
  if (at >= stolen_read_ + kStolen || std::ranges::any_of(stolen_, is_some)) {
    stolen_read_ = at;
    stolen_ = machine::stolen_times(content_of("/proc/stat"));
  }
  for (const tracing::Thread& thread : system.threads) {
    if (thread.jobs == 0) continue;
    if (auto facts = facts_of(key_of(thread))) reading.facts.push_back(std::move(*facts));
    timer_threads_.erase(key_of(thread));  // release-and-execute: it runs callbacks itself
  }
  for (const ThreadKey& thread : timer_threads_) {
    if (auto facts = facts_of(thread)) {
      facts->timers = true;
      reading.facts.push_back(std::move(*facts));
    }
  }
  return reading;
}

}  // namespace hotpath::watch
