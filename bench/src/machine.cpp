// SPDX-License-Identifier: Apache-2.0
#include "hotpath/bench/machine.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

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

}  // namespace

Machine read_machine() {
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
  return m;
}

nlohmann::json to_json(const Machine& m) {
  return {
      {"cpu_model", m.cpu_model},       {"processors", m.processors},       {"kernel", m.kernel},
      {"preempt_rt", m.preempt_rt},     {"distribution", m.distribution},   {"governor", m.governor},
      {"hypervisor", m.hypervisor},     {"rt_runtime_us", m.rt_runtime_us}, {"rt_period_us", m.rt_period_us},
      {"load_average", m.load_average}, {"compiler", m.compiler},           {"build_type", m.build_type}};
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
  if (m.build_type == "Debug") sentences.push_back("This is a debug build.");
  return sentences;
}

}  // namespace hotpath
