// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_facts.hpp"

#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "hotpath/live/thread_setup.hpp"
#include "machine/proc_files.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

std::string content_of(const std::string& path) {
  std::ostringstream content;
  content << std::ifstream(path).rdbuf();
  return content.str();
}

/// The names that hotpath's executors give to their timer threads, on rclcpp and of their own.
bool is_timer_thread(const std::string& name) { return name == "hotpath_timers" || name == "timer_mgmt"; }

std::string folder_of(const ThreadKey& thread) {
  return program::concat("/proc/", thread.first, "/task/", thread.second);
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

std::string process_name(std::uint32_t process) {
  return machine::first_line(program::concat("/proc/", process, "/comm"));
}

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

bool parse_schedstat(const std::string& text, Duration& ran, Duration& waited) {
  std::istringstream numbers(text);
  std::int64_t ran_ns = 0, waited_ns = 0;
  if (!(numbers >> ran_ns >> waited_ns)) return false;
  ran = Duration(ran_ns);
  waited = Duration(waited_ns);
  return true;
}

std::optional<ThreadFacts> ThreadReader::read(const ThreadKey& key) const {
  const std::string folder = folder_of(key);
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0 || status.st_uid != geteuid()) return std::nullopt;
  ThreadFacts facts{key.first, key.second};
  const auto id = static_cast<pid_t>(key.second);
  const auto policy = thread_policy(id);
  facts.processors = processors_of(id);
  if (!policy || facts.processors.empty() || !parse_stat(content_of(folder + "/stat"), facts) ||
      !parse_schedstat(content_of(folder + "/schedstat"), facts.ran, facts.waited))
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
    if (thread.id != 0 && access(folder_of(key_of(thread)).c_str(), F_OK) != 0)
      ended.push_back(key_of(thread));
  }
  for (const std::uint32_t process : known)
    if (access(folder_of({process, process}).c_str(), F_OK) != 0) ended.emplace_back(process, 0);
  for (const std::uint32_t process : processes) {
    for (const std::string& id : machine::names_in(program::concat("/proc/", process, "/task"))) {
      const ThreadKey thread(process, std::atol(id.c_str()));
      if (is_timer_thread(machine::first_line(folder_of(thread) + "/comm"))) timer_threads_.insert(thread);
    }
  }
}

/// Where a hypervisor withholds time, each reading needs the counters, since it has to explain what
/// happened since the one before.
void ThreadReader::read_stolen(Time at) {
  const bool withholds =
      std::ranges::any_of(stolen_, [](const auto& s) { return s.second > Duration::zero(); });
  if (!withholds && at < stolen_read_ + kStolen) return;
  stolen_read_ = at;
  stolen_ = machine::stolen_times(content_of("/proc/stat"));
}

ThreadReading ThreadReader::read(const tracing::System& system, Time at) {
  ThreadReading reading{at};
  if (at >= searched_ + kSearch) {
    searched_ = at;
    search(system, reading.ended);
  }
  read_stolen(at);
  for (const tracing::Thread& thread : system.threads) {
    if (thread.jobs == 0) continue;
    if (const auto facts = read(key_of(thread))) reading.facts.push_back(*facts);
    timer_threads_.erase(key_of(thread));  // release-and-execute: it runs callbacks itself
  }
  for (const ThreadKey& thread : timer_threads_) {
    auto facts = read(thread);
    if (!facts) continue;
    facts->timers = true;
    reading.facts.push_back(std::move(*facts));
  }
  return reading;
}

}  // namespace hotpath::watch
