// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"

#include <sys/prctl.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <future>
#include <sstream>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "machine/proc_files.hpp"
#include "program/text.hpp"

namespace hotpath::machine {

namespace {

std::string hypervisor() {
  const std::string flags = " " + value_of("/proc/cpuinfo", "flags", ':') + " ";
  if (flags.find(" hypervisor ") == std::string::npos) return "";
  const std::string product = first_line("/sys/class/dmi/id/product_name");
  return product.empty() ? "of unknown kind" : product;
}

std::string turbo() {
  const std::string off = first_line("/sys/devices/system/cpu/intel_pstate/no_turbo");  // Intel's driver
  const std::string on = first_line("/sys/devices/system/cpu/cpufreq/boost");           // other drivers
  if (off.empty() && on.empty()) return "unknown";
  return off == "0" || (off.empty() && on == "1") ? "on" : "off";
}

/// SCHED_FIFO and SCHED_RR threads of other processes, except kernel threads, which have no command
/// line.
std::vector<std::string> other_real_time_threads() {
  std::vector<std::string> threads;
  for (const std::string& pid : processes()) {
    const std::string process = "/proc/" + pid;
    if (pid == std::to_string(getpid()) || first_line(process + "/cmdline").empty()) continue;
    for (const std::string& thread : names_in(process + "/task")) {
      const ThreadPolicy policy = thread_policy(std::stoi(thread)).value_or(ThreadPolicy{});
      using Class = ThreadPolicy::Class;
      if (policy.scheduling_class != Class::fifo && policy.scheduling_class != Class::rr) continue;
      const std::string name = first_line(program::concat(process, "/task/", thread, "/comm"));
      threads.push_back(program::concat(name, " (", to_string(policy), ")"));
    }
  }
  return threads;
}

constexpr const char* kPacking = "sched_vcpu_pack";

/// The parameters that affect where and when threads run.
std::string boot_parameters() {
  constexpr std::array kNames = {"isolcpus",    "nohz_full",  "rcu_nocbs", "nosmt",
                                 "threadirqs",  "skew_tick",  "preempt",   "idle",
                                 "irqaffinity", "max_cstate", "nohlt"};
  std::istringstream command_line(first_line("/proc/cmdline"));
  std::vector<std::string> parameters;
  for (std::string parameter; command_line >> parameter;) {
    const std::string name = parameter.substr(0, parameter.find('='));
    if (name.starts_with("sched_") || name.find("haltpoll") != name.npos ||
        std::ranges::count(kNames, name.substr(name.rfind('.') + 1)) > 0)
      parameters.push_back(parameter);
  }
  return program::joined(parameters, " ");
}

/// The minimum of several rounds, to exclude interruptions.
double clock_cost(clockid_t clock) {
  constexpr int kReadings = 200;
  double best = 1e9;
  for (int round = 0; round < 20; ++round) {
    const std::int64_t begin = read_clock(CLOCK_MONOTONIC).count();
    for (int i = 0; i < kReadings; ++i) static_cast<void>(read_clock(clock));
    best = std::min(best, static_cast<double>(read_clock(CLOCK_MONOTONIC).count() - begin) / kReadings);
  }
  return best;
}

HiccupHistogram watch(Duration length) {
  HiccupHistogram distances;
  std::int64_t before = read_clock(CLOCK_MONOTONIC).count();
  const std::int64_t end = before + length.count();
  while (before < end) {
    const std::int64_t now = read_clock(CLOCK_MONOTONIC).count();
    distances.add(Duration(now - before));
    before = now;
  }
  return distances;
}

}  // namespace

Noise measure_noise(Duration length) {
  Noise noise;
  noise.length = length;
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  noise.clock_resolution = std::chrono::seconds(resolution.tv_sec) + Duration(resolution.tv_nsec);
  noise.clock_cost_ns = clock_cost(CLOCK_MONOTONIC);
  noise.cpu_clock_cost_ns = clock_cost(CLOCK_THREAD_CPUTIME_ID);

  const std::vector<int> cpus = allowed_cpus();
  noise.cores.resize(cpus.size());
  std::vector<std::future<void>> watchers;  // whose destructors join the threads
  std::promise<void> begin;                 // whose destructor, after an exception, ends their wait
  const std::shared_future<void> begun = begin.get_future();
  for (std::size_t i = 0; i < cpus.size(); ++i)
    watchers.push_back(std::async(std::launch::async, [&, i, begun] {
      pin_to_cpus({cpus[i]});
      begun.wait();
      noise.cores[i] = watch(length).summary(cpus[i]);
    }));
  begin.set_value();
  for (std::future<void>& w : watchers) w.get();
  return noise;
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
  static_cast<void>(getloadavg(&m.load_average, 1));  // which stays 0 on failure
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
  const auto warn_if = [&](bool unfit, const auto&... words) {
    if (unfit) sentences.push_back(program::concat(words...));
  };
  const auto brief = [](double value) { return std::to_string(value).substr(0, 4); };
  warn_if(!m.hypervisor.empty(),
          "This is a virtual machine: the hypervisor can withhold its CPUs at any time.");
  warn_if(!m.governor.empty() && m.governor != "performance", "The frequency governor is ", m.governor,
          ", not performance.");
  warn_if(m.load_average > 0.5 * m.processors, "Other programs are running: the load average is ",
          brief(m.load_average), " on ", m.processors, " processors.");
  warn_if(m.turbo == "on",
          "Turbo is on: the CPU frequency depends on the load of other cores and on the temperature.");
  warn_if(m.boot_parameters.find(kPacking) != std::string::npos,
          "The kernel packs threads of the default scheduling class onto few CPUs (", kPacking,
          "): ready threads may stay queued while a CPU is idle.");
  warn_if(m.stolen_percent > 1, "The hypervisor has taken ", brief(m.stolen_percent),
          " % of the CPU time since boot.");
  if (const std::size_t n = m.real_time_threads.size(); n > 0)
    warn_if(true, "Other real-time threads can preempt the measurement: ", m.real_time_threads.front(),
            n > 1 ? " and " + std::to_string(n - 1) + " more." : ".");
  const auto worst = std::ranges::max_element(m.noise.cores, {}, &Hiccups::max);
  if (worst != m.noise.cores.end())
    warn_if(worst->max > std::chrono::microseconds(500), "A thread that only read the clock on CPU ",
            worst->cpu, " was interrupted for ", worst->max.count() / 1000,
            " us: the executor need not be the cause of single latencies of that size.");
  for (const Hiccups& h : m.noise.cores)
    warn_if(h.lost_percent >= 2, "On CPU ", h.cpu, " a busy thread lost ", brief(h.lost_percent),
            " % of its time to interruptions.");
  warn_if(m.noise.clock_cost_ns > 200, "Reading the clock costs ", static_cast<int>(m.noise.clock_cost_ns),
          " ns, so it needs a system call; check the clock source.");
  warn_if(m.build_type == "Debug", "This is a debug build.");
  return sentences;
}

}  // namespace hotpath::machine
