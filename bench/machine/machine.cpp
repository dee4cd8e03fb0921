// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <thread>

#include "hotpath/live/thread_setup.hpp"
#include "machine/proc_files.hpp"
#include "program/text.hpp"

namespace hotpath::machine {

namespace {

bool has_flag(const std::string& flag) {
  return (" " + value_of("/proc/cpuinfo", "flags", ':') + " ").find(" " + flag + " ") != std::string::npos;
}

std::string hypervisor() {
  if (!has_flag("hypervisor")) return "";
  const std::string product = first_line("/sys/class/dmi/id/product_name");
  return product.empty() ? "of unknown kind" : product;
}

std::string turbo() {
  // Intel's driver reports `off`, other drivers report `on`.
  const std::string intel = first_line("/sys/devices/system/cpu/intel_pstate/no_turbo");
  if (!intel.empty()) return intel == "0" ? "on" : "off";
  const std::string boost = first_line("/sys/devices/system/cpu/cpufreq/boost");
  if (!boost.empty()) return boost == "1" ? "on" : "off";
  return "unknown";
}

/// SCHED_FIFO and SCHED_RR threads of other processes, except kernel threads, which have no command
/// line.
std::vector<std::string> other_real_time_threads() {
  std::vector<std::string> threads;
  for (const std::string& pid : processes()) {
    const std::string process = "/proc/" + pid;
    if (pid == std::to_string(getpid()) || first_line(process + "/cmdline").empty()) continue;
    for (const std::string& thread : names_in(process + "/task")) {
      const pid_t tid = std::stoi(thread);
      const int policy = sched_getscheduler(tid);
      if (policy != SCHED_FIFO && policy != SCHED_RR) continue;
      sched_param parameters{};
      sched_getparam(tid, &parameters);
      const auto kind = policy == SCHED_FIFO ? ThreadPolicy::Class::fifo : ThreadPolicy::Class::rr;
      threads.push_back(first_line(program::concat(process, "/task/", thread, "/comm")) + " (" +
                        to_string(ThreadPolicy{kind, parameters.sched_priority}) + ")");
    }
  }
  return threads;
}

constexpr const char* kPacking = "sched_vcpu_pack";

/// Whether the boot parameter affects where and when threads run.
bool affects_scheduling(std::string_view parameter) {
  constexpr std::array kWhole = {"isolcpus",    "nohz_full",  "rcu_nocbs", "nosmt",
                                 "threadirqs",  "skew_tick",  "preempt",   "idle",
                                 "irqaffinity", "max_cstate", "nohlt"};
  const std::string_view name = parameter.substr(0, parameter.find('='));
  const std::string_view last = name.substr(name.rfind('.') + 1);
  return name.starts_with("sched_") || name.find("haltpoll") != name.npos ||
         std::ranges::find(kWhole, last) != kWhole.end();
}

std::string boot_parameters() {
  std::istringstream command_line(first_line("/proc/cmdline"));
  std::vector<std::string> parameters;
  for (std::string parameter; command_line >> parameter;) {
    if (affects_scheduling(parameter)) parameters.push_back(parameter);
  }
  return program::joined(parameters, " ");
}

}  // namespace

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
  m.boot_parameters = boot_parameters();
  m.clock_source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  m.timer_slack_ns = prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
  m.stolen_percent = stolen_percent();
  m.real_time_threads = other_real_time_threads();
  m.noise = measure_noise(watch);
  return m;
}

std::vector<std::string> warnings(const Machine& m) {
  std::vector<std::string> sentences;
  const auto warn_if = [&](bool unfit, const std::string& sentence) {
    if (unfit) sentences.push_back(sentence);
  };
  warn_if(!m.hypervisor.empty(),
          "This is a virtual machine: the hypervisor can withhold its CPUs at any time.");
  warn_if(!m.governor.empty() && m.governor != "performance",
          "The frequency governor is " + m.governor + ", not performance.");
  warn_if(m.load_average > 0.5 * m.processors,
          program::text("Other programs are running: the load average is %.4s on %d processors.",
                        std::to_string(m.load_average).c_str(), m.processors));
  warn_if(m.turbo == "on",
          "Turbo is on: the CPU frequency depends on the load of other cores and on the temperature.");
  warn_if(m.boot_parameters.find(kPacking) != std::string::npos,
          program::concat("The kernel packs threads of the default scheduling class onto few CPUs (",
                          kPacking, "): ready threads may stay queued while a CPU is idle."));
  warn_if(m.stolen_percent > 1, program::text("The hypervisor has taken %.4s %% of the CPU time since boot.",
                                              std::to_string(m.stolen_percent).c_str()));
  if (const std::size_t n = m.real_time_threads.size(); n > 0) {
    sentences.push_back(
        "Other real-time threads can preempt the measurement: " + m.real_time_threads.front() +
        (n > 1 ? " and " + std::to_string(n - 1) + " more." : "."));
  }
  for (const std::string& sentence : warnings(m.noise)) sentences.push_back(sentence);
  warn_if(m.build_type == "Debug", "This is a debug build.");
  return sentences;
}

}  // namespace hotpath::machine
