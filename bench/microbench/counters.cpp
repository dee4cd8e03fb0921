// SPDX-License-Identifier: Apache-2.0
#include "microbench/counters.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <ctime>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath::gbench {

namespace {

constexpr const char* kFailed = "failed";

std::string encode(const Measurement& found) {
  std::ostringstream text;
  text.precision(std::numeric_limits<double>::max_digits10);
  text << "time " << found.time_ns << "\n";
  for (const auto& [name, value] : found.counters) text << name << " " << value << "\n";
  return text.str();
}

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> buffer;
  for (ssize_t n; (n = read(descriptor, buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return text;
}

[[noreturn]] void child(int descriptor, const std::function<Measurement()>& measure) {
  std::string text;
  try {
    text = encode(measure());
  } catch (const std::exception& error) {
    text = std::string(kFailed) + " " + error.what();
  }
  const bool written = write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  _exit(written ? 0 : 1);
}

}  // namespace

void Measurement::add_samples(const std::string& name, std::vector<double> samples_ns) {
  const Quantiles q = quantiles(std::move(samples_ns));
  if (q.n == 0) throw std::runtime_error("nothing was measured for " + name);
  if (time_ns == 0) time_ns = q.p50;
  counters.insert(counters.end(), {{name + "_p50_ns", q.p50},
                                   {name + "_p99_ns", q.p99},
                                   {name + "_p999_ns", q.p999},
                                   {name + "_max_ns", q.max}});
}

void run_isolated(benchmark::State& state, const std::function<Measurement()>& measure) {
  for (auto _ : state) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) return state.SkipWithError(std::strerror(errno));
    const pid_t pid = fork();
    if (pid < 0) return state.SkipWithError(std::strerror(errno));
    if (pid == 0) {
      close(ends[0]);
      child(ends[1], measure);
    }
    close(ends[1]);
    const std::string text = read_all(ends[0]);
    close(ends[0]);
    int status = 0;
    waitpid(pid, &status, 0);
    if (text.rfind(kFailed, 0) == 0) return state.SkipWithError(text.c_str());
    if (status != 0 || text.empty()) return state.SkipWithError("the process of the measurement died");

    std::istringstream lines(text);
    std::string name;
    for (double value = 0; lines >> name >> value;) {
      if (name == "time") {
        state.SetIterationTime(value / 1e9);
      } else {
        state.counters[name] = value;
      }
    }
  }
}

benchmark::internal::Benchmark* register_isolated(const std::string& name,
                                                  const std::function<Measurement()>& measure) {
  return benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) { run_isolated(s, measure); })
      ->Iterations(1)
      ->UseManualTime();
}

std::vector<double> warm(std::vector<double> samples) {
  samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 10));
  return samples;
}

Duration process_cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return std::chrono::seconds(t.tv_sec) + Duration(t.tv_nsec);
}

}  // namespace hotpath::gbench
