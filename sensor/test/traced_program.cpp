// SPDX-License-Identifier: Apache-2.0
// traced_program JOBS THREADS [fork | limit]: each thread creates a node with a publisher and runs jobs.
// Prints how many calls reached the stand-in, and exits with 1 if a call changed errno. With `fork`,
// a child process runs one more job in the main thread. With `limit`, the main thread runs a job before
// and after the threads, which may write no files.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "tracetools.hpp"

namespace {

void run_jobs(long jobs, const std::string& topic) {
  errno = 77;
  ros_trace_rcl_node_init(handle(1), handle(2), "node", "/space");
  ros_trace_rcl_publisher_init(handle(3), handle(1), handle(4), topic.c_str(), 7);
  for (long i = 0; i < jobs; ++i) {
    if (ros_trace_enabled_rmw_take()) ros_trace_do_rmw_take(handle(5), handle(6), -5, true);
    ros_trace_callback_start(handle(10), true);
    ros_trace_callback_end(handle(10));
  }
  if (errno != 77) std::_Exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string topic = "/" + std::string(99, 't');
  std::vector<std::thread> threads;
  const auto count = static_cast<std::size_t>(std::atoi(argv[2]));
  threads.reserve(count);
  const std::string option = argc > 3 ? argv[3] : "";
  if (option == "limit") {
    run_jobs(1, topic);
    constexpr rlimit kSmall = {4096, 4096};
    if (setrlimit(RLIMIT_FSIZE, &kSmall) != 0) return 1;
  }
  for (std::size_t i = 0; i < count; ++i) threads.emplace_back(run_jobs, std::atol(argv[1]), topic);
  for (std::thread& thread : threads) thread.join();
  if (option == "limit") run_jobs(1, topic);
  if (option == "fork") {
    run_jobs(1, topic);
    const pid_t child = fork();
    if (child == 0) {
      run_jobs(1, topic);
      std::_Exit(0);
    }
    int status = 0;
    if (waitpid(child, &status, 0) != child || status != 0) return 1;
  }
  std::cout << (stand_in_calls != nullptr ? stand_in_calls() : 0) << "\n";
  return 0;
}
