// SPDX-License-Identifier: Apache-2.0
#include "watch/thread_facts.hpp"

#include <sched.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "program/text.hpp"

namespace hotpath::watch {

namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The layout of Linux's struct sched_attr (version 0), which the C library lacks.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes), policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0, deadline = 0, period = 0;
};

std::optional<ThreadPolicy> policy_of(pid_t thread) {
  SchedulingAttributes attributes;
  if (syscall(SYS_sched_getattr, thread, &attributes, sizeof attributes, 0) != 0) return std::nullopt;
  using Class = ThreadPolicy::Class;
  const auto ns = [](std::uint64_t value) { return Duration(static_cast<std::int64_t>(value)); };
  const auto priority = static_cast<int>(attributes.priority);
  switch (attributes.policy) {
    case SCHED_FIFO:
      return ThreadPolicy{Class::fifo, priority};
    case SCHED_RR:
      return ThreadPolicy{Class::rr, priority};
    case SCHED_BATCH:
      return ThreadPolicy{Class::batch, attributes.nice};
    case SCHED_IDLE:
      return ThreadPolicy{Class::idle, attributes.nice};
    case 6:  // SCHED_DEADLINE
      return ThreadPolicy{Class::deadline, 0, ns(attributes.runtime), ns(attributes.deadline),
                          ns(attributes.period)};
    default:
      return ThreadPolicy{Class::other, attributes.nice};
  }
}

std::optional<std::uint64_t> processors_of(pid_t thread) {
  cpu_set_t set;
  if (sched_getaffinity(thread, sizeof set, &set) != 0) return std::nullopt;
  std::uint64_t processors = 0;
  for (int p = 0; p < 64; ++p)
    if (CPU_ISSET(p, &set)) processors |= std::uint64_t{1} << p;
  return processors;
}

}  // namespace

std::string process_name(std::uint32_t process) {
  std::string name = content_of(program::concat("/proc/", process, "/comm"));
  while (name.ends_with('\n')) name.pop_back();
  return name;
}

std::vector<int> processor_list(std::uint64_t processors) {
  std::vector<int> list;
  for (int p = 0; p < 64; ++p)
    if (((processors >> p) & 1) != 0) list.push_back(p);
  return list;
}

std::string shown_processors(std::uint64_t processors) {
  std::string text;
  for (const int p : processor_list(processors)) text += program::concat(text.empty() ? "" : ",", p);
  return text;
}

bool parse_stat(const std::string& text, std::string& name, int& processor) {
  const std::size_t open = text.find('('), close = text.rfind(')');  // a name may contain both
  if (open == std::string::npos || close == std::string::npos || close < open) return false;
  name = text.substr(open + 1, close - open - 1);
  std::istringstream rest(text.substr(close + 1));
  std::string field;
  constexpr int kProcessor = 39, kAfterName = 3;  // proc(5) counts fields from 1
  for (int f = kAfterName; f < kProcessor; ++f) rest >> field;
  return static_cast<bool>(rest >> processor);
}

bool parse_schedstat(const std::string& text, Duration& ran, Duration& waited) {
  std::istringstream numbers(text);
  std::int64_t ran_ns = 0, waited_ns = 0;
  if (!(numbers >> ran_ns >> waited_ns)) return false;
  ran = Duration(ran_ns);
  waited = Duration(waited_ns);
  return true;
}

std::map<int, Duration> parse_stolen(const std::string& text) {
  constexpr int kSteal = 8;  // user, nice, system, idle, iowait, irq, softirq, steal
  static const long ticks = sysconf(_SC_CLK_TCK);
  std::map<int, Duration> stolen;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string word;
    fields >> word;
    if (!word.starts_with("cpu") || word.size() == 3) continue;
    std::int64_t value = 0;
    for (int f = 0; f < kSteal; ++f) fields >> value;
    if (fields) stolen[std::atoi(word.c_str() + 3)] = std::chrono::seconds(1) * value / ticks;
  }
  return stolen;
}

std::vector<std::optional<ThreadFacts>> ThreadReader::read(const tracing::System& system) {
  stolen_ = parse_stolen(content_of("/proc/stat"));
  std::vector<std::optional<ThreadFacts>> all(system.threads.size());
  for (std::size_t t = 0; t < system.threads.size(); ++t) {
    const tracing::Thread& thread = system.threads[t];
    if (thread.jobs == 0) continue;
    const std::string folder = program::concat("/proc/", thread.process, "/task/", thread.id);
    struct stat status {};
    if (stat(folder.c_str(), &status) != 0 || status.st_uid != geteuid()) continue;
    ThreadFacts facts;
    const auto id = static_cast<pid_t>(thread.id);
    const auto policy = policy_of(id);
    const auto processors = processors_of(id);
    if (!policy || !processors || !parse_stat(content_of(folder + "/stat"), facts.name, facts.processor) ||
        !parse_schedstat(content_of(folder + "/schedstat"), facts.ran, facts.waited))
      continue;
    facts.policy = *policy;
    facts.processors = *processors;
    if (const auto stolen = stolen_.find(facts.processor); stolen != stolen_.end())
      facts.stolen = stolen->second;
    all[t] = facts;
  }
  return all;
}

}  // namespace hotpath::watch
