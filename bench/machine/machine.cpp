// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "hotpath/live/thread_setup.hpp"

namespace hotpath {

namespace {

std::string first_line(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

/// Value of the first `key<separator>value` line of a file.
std::string value_of(const std::string& path, const std::string& key, char separator) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) != 0) continue;
    std::size_t from = line.find(separator);
    if (from == std::string::npos) continue;
    from = line.find_first_not_of(" \t\"", from + 1);
    if (from == std::string::npos) return "";
    return line.substr(from, line.find_last_not_of(" \t\"") + 1 - from);
  }
  return "";
}

long number_in(const std::string& path, long otherwise) {
  std::ifstream in(path);
  long value = otherwise;
  in >> value;
  return in ? value : otherwise;
}

bool has_flag(const std::string& flag) {
  return (" " + value_of("/proc/cpuinfo", "flags", ':') + " ").find(" " + flag + " ") != std::string::npos;
}

std::string hypervisor() {
  if (!has_flag("hypervisor")) return "";
  const std::string product = first_line("/sys/class/dmi/id/product_name");
  return product.empty() ? "unknown" : product;
}

std::string turbo() {
  // Intel's driver says when it is off, the others when it is on.
  const std::string intel = first_line("/sys/devices/system/cpu/intel_pstate/no_turbo");
  if (!intel.empty()) return intel == "0" ? "on" : "off";
  const std::string boost = first_line("/sys/devices/system/cpu/cpufreq/boost");
  if (!boost.empty()) return boost == "1" ? "on" : "off";
  return "unknown";
}

double stolen_percent() {
  std::istringstream fields(first_line("/proc/stat"));
  std::string cpu;
  fields >> cpu;
  double total = 0, stolen = 0, field = 0;
  // user nice system idle iowait irq softirq steal
  for (int i = 0; i < 8 && fields >> field; ++i) {
    total += field;
    if (i == 7) stolen = field;
  }
  return total > 0 ? 100 * stolen / total : 0;
}

/// Threads at SCHED_FIFO or SCHED_RR outside of this process; the kernel's own have no memory map and do not
/// count.
std::vector<std::string> other_real_time_threads() {
  namespace fs = std::filesystem;
  std::vector<std::string> found;
  std::error_code gone;  // processes end while we look
  for (const fs::directory_entry& process : fs::directory_iterator("/proc", gone)) {
    const std::string pid = process.path().filename();
    if (pid.find_first_not_of("0123456789") != std::string::npos || pid == std::to_string(getpid())) continue;
    if (first_line(process.path() / "cmdline").empty()) continue;
    for (const fs::directory_entry& thread : fs::directory_iterator(process.path() / "task", gone)) {
      const pid_t tid = std::stoi(thread.path().filename());
      const int policy = sched_getscheduler(tid);
      if (policy != SCHED_FIFO && policy != SCHED_RR) continue;
      sched_param parameters{};
      sched_getparam(tid, &parameters);
      const auto kind = policy == SCHED_FIFO ? ThreadPolicy::Class::fifo : ThreadPolicy::Class::rr;
      found.push_back(first_line(thread.path() / "comm") + " (" +
                      to_string(ThreadPolicy{kind, parameters.sched_priority}) + ")");
    }
  }
  return found;
}

}  // namespace

Duration stolen_time(const std::string& proc_stat, const std::vector<int>& cpus) {
  std::istringstream stat(proc_stat);
  std::string line;
  long long ticks = 0;
  while (std::getline(stat, line) && line.rfind("cpu", 0) == 0) {
    std::istringstream fields(line);
    std::string cpu;
    long long user = 0, nice = 0, system = 0, idle = 0, iowait = 0, irq = 0, softirq = 0, steal = 0;
    fields >> cpu >> user >> nice >> system >> idle >> iowait >> irq >> softirq >> steal;
    const bool asked_for = std::any_of(cpus.begin(), cpus.end(),
                                       [&](int number) { return cpu == "cpu" + std::to_string(number); });
    if (cpus.empty() ? cpu == "cpu" : asked_for) ticks += steal;
  }
  return Duration(std::chrono::seconds(1)) * ticks / sysconf(_SC_CLK_TCK);
}

Duration stolen_time(const std::vector<int>& cpus) {
  std::ifstream file("/proc/stat");
  std::ostringstream content;
  content << file.rdbuf();
  return stolen_time(content.str(), cpus);
}

Machine read_machine(Duration watch) {
  Machine m;
  m.cpu_model = value_of("/proc/cpuinfo", "model name", ':');
  utsname name{};
  uname(&name);
  m.kernel = std::string(name.release) + " " + name.machine;
  m.preempt_rt = std::string(name.version).find("PREEMPT_RT") != std::string::npos;
  m.distribution = value_of("/etc/os-release", "PRETTY_NAME", '=');
  m.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  m.hypervisor = hypervisor();
  m.compiler = "g++ " __VERSION__;
  m.build_type = HOTPATH_BUILD_TYPE;
  m.processors = static_cast<int>(std::thread::hardware_concurrency());
  m.rt_runtime_us = number_in("/proc/sys/kernel/sched_rt_runtime_us", -1);
  m.rt_period_us = number_in("/proc/sys/kernel/sched_rt_period_us", 0);
  double loads[1] = {0};
  if (getloadavg(loads, 1) == 1) m.load_average = loads[0];
  m.turbo = turbo();
  m.clock_source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  m.timer_slack_ns = prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
  m.stolen_percent = stolen_percent();
  m.real_time_threads = other_real_time_threads();
  m.noise = measure_noise(watch);
  return m;
}

nlohmann::json to_json(const Machine& m) {
  return {{"cpu_model", m.cpu_model},
          {"processors", m.processors},
          {"kernel", m.kernel},
          {"preempt_rt", m.preempt_rt},
          {"distribution", m.distribution},
          {"governor", m.governor},
          {"hypervisor", m.hypervisor},
          {"rt_runtime_us", m.rt_runtime_us},
          {"rt_period_us", m.rt_period_us},
          {"load_average", m.load_average},
          {"compiler", m.compiler},
          {"build_type", m.build_type},
          {"turbo", m.turbo},
          {"clock_source", m.clock_source},
          {"timer_slack_ns", m.timer_slack_ns},
          {"stolen_percent", m.stolen_percent},
          {"real_time_threads", m.real_time_threads},
          {"noise", to_json(m.noise)}};
}

std::vector<std::string> warnings(const Machine& m) {
  std::vector<std::string> sentences;
  if (!m.hypervisor.empty()) {
    sentences.push_back("This is a virtual machine: its processors can be taken away at any time.");
  }
  if (!m.governor.empty() && m.governor != "performance") {
    sentences.push_back("The frequency governor is " + m.governor + ", not performance.");
  }
  if (m.load_average > 0.5 * m.processors) {
    sentences.push_back("Something else is running: the load average is " +
                        std::to_string(m.load_average).substr(0, 4) + " on " + std::to_string(m.processors) +
                        " processors.");
  }
  if (m.turbo == "on") {
    sentences.push_back(
        "Turbo is on: the processor's speed depends on what else it does and on its temperature.");
  }
  if (m.stolen_percent > 1) {
    sentences.push_back("The hypervisor has taken " + std::to_string(m.stolen_percent).substr(0, 4) +
                        " % of the processors' time since boot.");
  }
  if (!m.real_time_threads.empty()) {
    sentences.push_back("Other real-time threads run here and come first whenever they want to: " +
                        m.real_time_threads.front() +
                        (m.real_time_threads.size() > 1
                             ? " and " + std::to_string(m.real_time_threads.size() - 1) + " more."
                             : "."));
  }
  for (const std::string& sentence : warnings(m.noise)) sentences.push_back(sentence);
  if (m.build_type == "Debug") sentences.push_back("This is a debug build.");
  return sentences;
}

}  // namespace hotpath
