// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/live/thread_setup.hpp"
#include "hotpath/tracing/system.hpp"
#include "machine/proc_files.hpp"
#include "program/memory_limit.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

/// A thread by the ids of its process and of itself.
using ThreadKey = std::pair<std::uint32_t, std::uint32_t>;
[[nodiscard]] inline ThreadKey key_of(const tracing::Thread& thread) { return {thread.process, thread.id}; }

/// What the operating system says of a thread at one instant.
struct ThreadFacts {
  std::uint32_t process = 0, thread = 0;  ///< Ids.
  bool timers = false;                    ///< The timer thread of one of hotpath's executors.
  std::string name = {};                  ///< Of the thread (comm).
  char state = 'S';                       ///< As in proc(5): R: runs or could run; T: stopped.
  ThreadPolicy policy = {};
  bool inherited = false;  ///< The policy has a niceness, which is that of the watcher when it began.
  std::vector<int> processors = {};  ///< On which it may run, ascending.
  Duration ran{};                    ///< Since its beginning.
  Duration waited{};                 ///< Ready to run, without a processor.
  int processor = -1;                ///< On which it ran last.
  Duration stolen{};                 ///< Withheld by the hypervisor from that processor.
  std::uint64_t started = 0;         ///< Clock ticks since the boot: ids are used again.
  std::uint64_t throttled = 0;       ///< How often the control group of its process has been throttled.
  std::string quota = {};            ///< Of that control group: `1.000 ms in 100.000 ms`; empty: none.

  [[nodiscard]] ThreadKey key() const { return {process, thread}; }
};

/// The threads of a system at one instant.
struct ThreadReading {
  Time at{};
  /// Without threads that have ended, or are of another pid namespace or user.
  std::vector<ThreadFacts> facts = {};
  /// That have ended, as far as the reading searched for them. Id 0: their process has.
  std::vector<ThreadKey> ended = {};
};

/// Facts from the content of /proc/PID/task/TID/stat and schedstat; false: invalid.
[[nodiscard]] inline bool parse_stat(const std::string& text, ThreadFacts& facts) {
  const std::size_t open = text.find('('), close = text.rfind(')');  // a name may contain both
  if (open == std::string::npos || close == std::string::npos || close < open) return false;
  facts.name = text.substr(open + 1, close - open - 1);
  constexpr std::size_t kStart = 22, kProcessor = 39, kState = 3;  // proc(5) counts fields from 1
  std::istringstream rest(text.substr(close + 1));
  const std::vector<std::string> fields(std::istream_iterator<std::string>(rest), {});
  if (fields.size() + kState <= kProcessor) return false;
  facts.state = fields.front().front();
  facts.started = std::strtoull(fields[kStart - kState].c_str(), nullptr, 10);
  facts.processor = std::atoi(fields[kProcessor - kState].c_str());
  return true;
}
[[nodiscard]] inline bool parse_schedstat(const std::string& text, ThreadFacts& facts) {
  std::istringstream numbers(text);
  std::int64_t ran_ns = 0, waited_ns = 0;
  if (!(numbers >> ran_ns >> waited_ns)) return false;
  facts.ran = Duration(ran_ns);
  facts.waited = Duration(waited_ns);
  return true;
}

/// What a control group may run: of cpu.max (v2), or of two files (v1).
[[nodiscard]] inline std::string quota_of(const std::string& folder) {
  long quota_us = machine::number_in(folder + "/cpu.cfs_quota_us", 0);
  long period_us = machine::number_in(folder + "/cpu.cfs_period_us", 0);
  std::ifstream(folder + "/cpu.max") >> quota_us >> period_us;
  if (quota_us <= 0 || period_us <= 0) return "";
  return program::text("%.3f ms in %.3f ms", static_cast<double>(quota_us) / 1000,
                       static_cast<double>(period_us) / 1000);
}

/// Linux counts a wait when it ends. This adds that of a thread which could run, but runs nothing.
class LastingWaits {
 public:
  /// `waited` of the facts, with the wait that has not ended.
  [[nodiscard]] Duration with(const ThreadFacts& facts, Time at) {
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
  void forget(const ThreadKey& ended) { known_.erase(ended); }

 private:
  struct Known {
    std::uint64_t started = 0;
    Duration ran{}, shown{};
    Time since{};  ///< Of the latest facts with another `ran` or state.
  };
  std::map<ThreadKey, Known> known_;
};

/// Reads the threads that run callbacks, and the timer threads of hotpath's executors beside them, from
/// /proc.
class ThreadReader {
 public:
  /// Some microseconds for each thread.
  [[nodiscard]] ThreadReading read(const tracing::System& system, Time at) {
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
      stolen_ = machine::stolen_times(program::content_of("/proc/stat"));
    }
    for (const tracing::Thread& thread : system.threads) {
      if (thread.jobs == 0) continue;
      add_facts(key_of(thread), false, reading);
      timer_threads_.erase(key_of(thread));  // release-and-execute: it runs callbacks itself
    }
    for (const ThreadKey& thread : timer_threads_) add_facts(thread, true, reading);
    return reading;
  }

 private:
  /// Between two searches for timer threads and threads that have ended.
  static constexpr Duration kSearch = std::chrono::milliseconds(500);
  /// Between two readings of what the hypervisor withheld, as long as that is nothing. Otherwise each reading
  /// has to explain what happened since the one before.
  static constexpr Duration kStolen = std::chrono::milliseconds(100);

  static std::string folder_of(const ThreadKey& thread) {
    return program::concat("/proc/", thread.first, "/task/", thread.second);
  }
  static bool lives(const ThreadKey& thread) { return access(folder_of(thread).c_str(), F_OK) == 0; }
  static std::vector<std::string> threads_of(std::uint32_t process) {
    return machine::names_in(program::concat("/proc/", process, "/task"));
  }
  /// Whether it has no thread that has not ended; its parent may not know yet.
  static bool has_ended(std::uint32_t process) {
    ThreadFacts facts;
    const ThreadKey first(process, process);
    if (!lives(first)) return true;
    if (!parse_stat(program::content_of(folder_of(first) + "/stat"), facts) || facts.state != 'Z')
      return false;
    return threads_of(process).size() == 1;
  }

  void search(const tracing::System& system, std::vector<ThreadKey>& ended) {
    timer_threads_.clear();
    groups_.clear();
    std::set<std::uint32_t> processes;
    for (const tracing::Thread& thread : system.threads) {
      if (thread.jobs > 0) processes.insert(thread.process);
      if (thread.id != 0 && !lives(key_of(thread))) ended.push_back(key_of(thread));
    }
    for (const ThreadKey& thread : ended) waits_.forget(thread);
    for (const std::uint32_t process : processes) {
      const std::string groups = program::content_of(program::concat("/proc/", process, "/cgroup"));
      const std::string group = program::cgroup_folder(groups, "cpu");
      groups_[process] = {group + "/cpu.stat", quota_of(group)};
      for (const std::string& id : threads_of(process)) {
        const ThreadKey thread(process, std::atol(id.c_str()));
        const std::string name = machine::first_line(folder_of(thread) + "/comm");
        if (name == "hotpath_timers" || name == "timer_mgmt")  // on rclcpp, or of hotpath's own
          timer_threads_.insert(thread);
      }
    }
  }
  /// Adds nothing of a thread that has ended, or is of another pid namespace or user.
  void add_facts(const ThreadKey& thread, bool timers, ThreadReading& reading) {
    const std::string folder = folder_of(thread);
    struct stat status {};
    if (stat(folder.c_str(), &status) != 0 || status.st_uid != geteuid()) return;
    ThreadFacts facts{thread.first, thread.second, timers};
    const auto id = static_cast<pid_t>(thread.second);
    const auto policy = thread_policy(id);
    facts.processors = allowed_cpus(id);
    if (!policy || facts.processors.empty() || !parse_stat(program::content_of(folder + "/stat"), facts) ||
        !parse_schedstat(program::content_of(folder + "/schedstat"), facts))
      return;
    facts.policy = *policy;
    facts.inherited = policy->ordinary() && policy->priority != 0 && *policy == own_;
    if (const auto stolen = stolen_.find(facts.processor); stolen != stolen_.end())
      facts.stolen = stolen->second;
    facts.waited = waits_.with(facts, reading.at);
    if (const auto group = groups_.find(thread.first); group != groups_.end()) {
      facts.quota = group->second.second;
      facts.throttled =
          std::strtoull(machine::value_of(group->second.first, "nr_throttled", ' ').c_str(), nullptr, 10);
    }
    reading.facts.push_back(std::move(facts));
  }

  Time searched_{}, stolen_read_{};
  LastingWaits waits_;
  const ThreadPolicy own_ = own_thread_policy();
  std::map<int, Duration> stolen_;  // by processor
  std::set<ThreadKey> timer_threads_;
  /// By process, of its control group: the file with its throttlings, and its quota.
  std::map<std::uint32_t, std::pair<std::string, std::string>> groups_;
};

}  // namespace hotpath::watch
