// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_facts.hpp"

#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>

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

/// Whether it has no thread that has not ended; its parent may not know yet.
bool has_ended(std::uint32_t process) {
  ThreadFacts facts;
  const ThreadKey first(process, process);
  if (!lives(first)) return true;
  if (!parse_stat(content_of(folder_of(first) + "/stat"), facts) || facts.state != 'Z') return false;
  return machine::names_in(program::concat("/proc/", process, "/task")).size() == 1;
}

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

std::string group_file(const std::string& cgroup) {
  std::istringstream lines(cgroup);
  std::string file;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = std::min(line.find(':'), line.size()), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool unified = controllers == ",,";
    if (controllers.find(",cpu,") != std::string::npos || (unified && file.empty()))
      file = (unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/cpu") + line.substr(second + 1) + "/cpu.stat";
  }
  return file;
}

Duration LastingWaits::with(const ThreadFacts& facts, Time at) {
  constexpr Duration kLasting = std::chrono::milliseconds(100);  // a running thread is counted sooner
  static const bool counted_late =
      machine::first_line("/sys/devices/system/cpu/nohz_full").find_first_of("0123456789") !=
      std::string::npos;
  Known& known = known_[facts.key()];
  if (known.started != facts.started) known = {facts.started, {}, {}, at};
  if (facts.state != 'R' || facts.ran != std::exchange(known.ran, facts.ran)) known.since = at;
  const bool lasts = at - known.since >= kLasting && !counted_late;
  return known.shown = std::max(known.shown, facts.waited + (lasts ? at - known.since : Duration{}));
}

std::optional<ThreadFacts> ThreadReader::facts_of(const ThreadKey& thread, Time at) {
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
  facts.inherited = policy->ordinary() && policy->priority != 0 && *policy == own_;
  if (const auto stolen = stolen_.find(facts.processor); stolen != stolen_.end())
    facts.stolen = stolen->second;
  facts.waited = waits_.with(facts, at);
  if (const auto group = groups_.find(thread.first); group != groups_.end()) {
    std::ifstream values(group->second);
    std::string key;
    for (std::uint64_t value = 0; values >> key >> value;)
      if (key == "nr_throttled") facts.throttled = value;
  }
  return facts;
}

void ThreadReader::search(const tracing::System& system, std::vector<ThreadKey>& ended) {
  timer_threads_.clear();
  groups_.clear();
  std::set<std::uint32_t> processes;
  for (const tracing::Thread& thread : system.threads) {
    if (thread.jobs > 0) processes.insert(thread.process);
    if (thread.id != 0 && !lives(key_of(thread))) ended.push_back(key_of(thread));
  }
  for (const ThreadKey& thread : ended) waits_.forget(thread);
  for (const std::uint32_t process : processes) {
    groups_[process] = group_file(content_of(program::concat("/proc/", process, "/cgroup")));
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
  std::set<std::uint32_t> processes = system.processes;
  for (const tracing::Thread& thread : system.threads)
    if (thread.id != 0) processes.insert(thread.process);
  for (const std::uint32_t process : processes)
    if (has_ended(process)) reading.ended.emplace_back(process, 0);
  const auto is_some = [](const auto& stolen) { return stolen.second > Duration::zero(); };
  if (at >= stolen_read_ + kStolen || std::ranges::any_of(stolen_, is_some)) {
    stolen_read_ = at;
    stolen_ = machine::stolen_times(content_of("/proc/stat"));
  }
  for (const tracing::Thread& thread : system.threads) {
    if (thread.jobs == 0) continue;
    if (auto facts = facts_of(key_of(thread), at)) reading.facts.push_back(std::move(*facts));
    timer_threads_.erase(key_of(thread));  // release-and-execute: it runs callbacks itself
  }
  for (const ThreadKey& thread : timer_threads_) {
    if (auto facts = facts_of(thread, at)) {
      facts->timers = true;
      reading.facts.push_back(std::move(*facts));
    }
  }
  return reading;
}

}  // namespace hotpath::watch
