// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "simulation.hpp"

namespace independent {

Executor::Executor(const std::string& name) : label(name) {
  const std::string base = name.substr(0, name.find(':'));
  samples_first = name.find(":first") != std::string::npos;
  fifo = name.find(":fifo") != std::string::npos;
  if (base == "default" || base.starts_with("static")) {
    family = Family::wait_set;
    timers_first = base == "default";
    waits_after_each_job = base == "static-jazzy";
  } else if (base == "cbg" || base == "cbg-3178") {
    family = Family::groups;
    at_dispatch = base != "cbg";
  } else if (base != "events-ro") {
    policy = base.substr(0, base.find('-'));
    family = policy == "edf" ? Family::deadline : Family::fixed_priority;
    if (policy != "rm" && policy != "dm" && policy != "fp" && policy != "edf")
      throw std::runtime_error("unknown executor " + name);
  }
}

}  // namespace independent
