// SPDX-License-Identifier: Apache-2.0
#include "middleware_threads.hpp"

#include <rmw/rmw.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include "hotpath/live/thread_setup.hpp"

namespace hotpath {

namespace {

/// How the names begin: of Fast DDS from 2.12 on (receiving threads, events, asynchronous writers), and
/// of Cyclone DDS (receiving threads, delivery queues, timed events).
constexpr std::array<std::string_view, 4> kNames = {"dds.", "recv", "dq.", "tev"};
/// Fast DDS's watchdog of shared memory handles no sample.
constexpr std::string_view kWatchdog = "dds.shm.wdog";

}  // namespace

bool is_of_middleware(const std::string& thread) {
  return thread != kWatchdog &&
         std::ranges::any_of(kNames, [&](std::string_view name) { return thread.starts_with(name); });
}

void set_middleware_policy(const ThreadPolicy& policy) {
  std::size_t found = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(task.path() / "comm");
    std::string name;
    if (!std::getline(file, name) || !is_of_middleware(name)) continue;
    set_thread_policy(std::stoi(task.path().filename().string()), policy);
    ++found;
  }
  if (found > 0) return;
  throw std::runtime_error("middleware_threads is " + to_string(policy) + ", but no thread of " +
                           rmw_get_implementation_identifier() +
                           " is known by its name; use rmw_fastrtps_cpp with Fast DDS 2.12 or later or "
                           "rmw_cyclonedds_cpp, or set the policy in the middleware's own configuration");
}

}  // namespace hotpath
