// SPDX-License-Identifier: Apache-2.0
// One-way latency, publication to start of the callback, and CPU time per message of every transport; beside
// each path over Fast DDS, Fast DDS with the same threads and none of our code.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "microbench/counters.hpp"
#include "microbench/program.hpp"
#include "microbench/transport_sides.hpp"

namespace {

using namespace hotpath;
using namespace std::chrono_literals;
using gbench::Measurement;
using gbench::ns;
using gbench::Path;
using gbench::Plan;

/// Publishes the plan's messages at its rate; returns the CPU time that the process used after the warm-up.
template <class Side>
Duration publish_all(Side& side, const Plan& plan, const std::function<void()>& warm) {
  minimise_timer_slack();
  Duration before{};
  Time next = now() + 5ms;
  for (int i = 0; i < plan.messages + plan.warm_up(); ++i) {
    if (i == plan.warm_up()) {
      warm();
      before = gbench::process_cpu_time();
    }
    gbench::sleep_until(next);
    auto& message = side.borrow();
    message.number(static_cast<std::uint64_t>(i));
    message.published(to_ns(now()));
    side.publish(message);
    // Never in bursts, however late we are.
    next = std::max(next + plan.period, now() + plan.period / 2);
  }
  std::this_thread::sleep_for(20ms);  // what is under way arrives
  return gbench::process_cpu_time() - before;
}

Measurement measurement_of(std::vector<double> latencies, Duration cpu, const Plan& plan) {
  const double arrived = static_cast<double>(latencies.size()) / static_cast<double>(plan.samples());
  const auto warm =
      static_cast<std::ptrdiff_t>(latencies.size()) * plan.warm_up() / (plan.messages + plan.warm_up());
  latencies.erase(latencies.begin(), latencies.begin() + warm);
  Measurement found;
  found.add_samples("latency", std::move(latencies));
  found.counters.emplace_back("cpu_per_message_ns", ns(cpu) / plan.messages);
  found.counters.emplace_back("arrived_percent", 100 * arrived);
  return found;
}

template <class Side>
Measurement in_one_process(const Plan& plan) {
  Side side(plan);
  side.add_subscribers();
  side.add_writer();
  side.wait_until_matched();
  side.start();
  const Duration cpu = publish_all(side, plan, [] {});
  return measurement_of(side.stop(), cpu, plan);
}

void tell(int descriptor, std::int64_t number) {
  if (write(descriptor, &number, sizeof(number)) != sizeof(number)) _exit(1);
}

std::int64_t hear(int descriptor) {
  std::int64_t number = 0;
  if (read(descriptor, &number, sizeof(number)) != sizeof(number)) {
    throw std::runtime_error("the publishing process died");
  }
  return number;
}

/// Subscribers in this process, the publisher in another.
template <class Side>
Measurement in_two_processes(const Plan& plan) {
  std::array<int, 2> from_publisher{}, to_publisher{};
  if (pipe(from_publisher.data()) != 0 || pipe(to_publisher.data()) != 0) {
    throw std::runtime_error("no pipe to the publishing process");
  }
  const pid_t publisher = fork();
  if (publisher < 0) throw std::runtime_error("cannot start the publishing process");
  if (publisher == 0) {
    close(from_publisher[0]);
    close(to_publisher[1]);
    try {
      Side side(plan);
      side.add_writer();
      side.wait_until_matched();
      const Duration cpu = publish_all(side, plan, [&] { tell(from_publisher[1], 0); });
      tell(from_publisher[1], cpu.count());
      hear(to_publisher[0]);
    } catch (const std::exception&) {  // the subscribers' process has gone, or finds out that we have
    }
    _exit(0);
  }
  close(from_publisher[1]);
  close(to_publisher[0]);
  Measurement found;
  {
    Side side(plan);
    side.add_subscribers();
    side.start();
    side.wait_until_matched();
    hear(from_publisher[0]);
    const Duration before = gbench::process_cpu_time();
    const Duration publishers(hear(from_publisher[0]));
    const Duration own = gbench::process_cpu_time() - before;
    found = measurement_of(side.stop(), own + publishers, plan);
    tell(to_publisher[1], 0);
  }
  waitpid(publisher, nullptr, 0);
  return found;
}

template <template <class> class Side, class Traits>
void add(const std::string& name, const Plan& plan) {
  const bool two = plan.path == Path::fastdds_shared_memory || plan.path == Path::fastdds_udp;
  gbench::register_isolated(name, [=] {
    return two ? in_two_processes<Side<Traits>>(plan) : in_one_process<Side<Traits>>(plan);
  })->Unit(benchmark::kMicrosecond);
}

template <class Traits>
void add_path(const char* path_name, Path path, std::uint32_t subscribers, bool quick) {
  Plan plan;
  plan.path = path;
  plan.subscribers = subscribers;
  const auto kib = sizeof(typename Traits::Message) / 1024;
  plan.period = 1ms * std::max<std::int64_t>(1, std::max<std::int64_t>(kib / 64, subscribers / 10));
  // About the same time for all, with enough messages for a median.
  plan.messages = static_cast<int>(std::clamp<std::int64_t>((quick ? 100ms : 400ms) / plan.period, 30, 400));
  const std::string name = std::string("one_way/") + path_name + "/kib:" + std::to_string(kib) +
                           "/subscribers:" + std::to_string(subscribers);
  add<gbench::HotpathSide, Traits>(name + "/hotpath", plan);
  if (path != Path::intra_process) add<gbench::RawSide, Traits>(name + "/raw_fastdds", plan);
}

void register_all(bool quick) {
  const std::array paths = {std::pair{"intra_process", Path::intra_process},
                            std::pair{"fastdds_in_process", Path::fastdds_in_process},
                            std::pair{"fastdds_shared_memory", Path::fastdds_shared_memory},
                            std::pair{"fastdds_udp", Path::fastdds_udp}};
  for (const auto& [name, path] : paths) {
    for (const std::uint32_t subscribers : {1U, 10U, 100U})
      add_path<gbench::Payload4k>(name, path, subscribers, quick);
    add_path<gbench::Payload64k>(name, path, 1, quick);
    add_path<gbench::Payload256k>(name, path, 1, quick);
    add_path<gbench::Payload1m>(name, path, 1, quick);
  }
}

}  // namespace

int main(int argc, char** argv) { return gbench::run_program(argc, argv, register_all); }
