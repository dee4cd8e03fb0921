// SPDX-License-Identifier: Apache-2.0
// A system that keeps its contract until a fault: `faulty_program EXECUTOR FAULT SAMPLES`.
//
// A timer publishes to a filter, which publishes to a sink. At sample number SAMPLES the fault
// happens; the program prints `fault NANOSECONDS` (CLOCK_MONOTONIC), and goes on until SIGINT. `end`
// ends it instead.
//
// `faulty_program EXECUTOR load SAMPLES TIMERS PERIOD_US` has as many timers, which publish every
// PERIOD_US microseconds to one subscription each, and ends after SAMPLES samples.
//
// `faulty_program EXECUTOR clock SAMPLES` runs no executor: it calls two tracepoints every 5 ms and
// prints the clock that it reads after each. `faulty_program EXECUTOR cost BURSTS` prints the time of
// one tracepoint, from bursts of 1000 every 20 ms.
#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <tracetools/tracetools.h>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <rcl_interfaces/srv/list_parameters.hpp>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace {

using std_msgs::msg::Int32;
using List = rcl_interfaces::srv::ListParameters;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Duration = std::chrono::nanoseconds;

constexpr Duration kPeriod = 20ms, kWork = 2ms;
constexpr int kDepth = 10;

/// Runs for a time on the clock, so that a job is exactly as long as stated unless it is displaced
/// at its end.
void work(Duration length) {
  const auto end = Clock::now() + length;
  while (Clock::now() < end) {
  }
}

long long now_ns() { return std::chrono::duration_cast<Duration>(Clock::now().time_since_epoch()).count(); }

void report_fault() {
  std::printf("fault %lld\n", now_ns());
  std::fflush(stdout);
}

Int32 message(int number) {
  Int32 sample;
  sample.data = number;
  return sample;
}

/// A thread belongs to the executor if it runs callbacks; the middleware's threads run none.
void change_policy() {
  sched_param parameter{};
  int policy = 0;
  pthread_getschedparam(pthread_self(), &policy, &parameter);
  parameter.sched_priority = policy == SCHED_OTHER ? 1 : 0;
  if (pthread_setschedparam(pthread_self(), policy == SCHED_OTHER ? SCHED_FIFO : SCHED_OTHER, &parameter) !=
      0)
    std::fputs("faulty_program: no permission to change the policy\n", stderr), std::_Exit(EXIT_FAILURE);
}

void change_affinity() {
  cpu_set_t set;
  pthread_getaffinity_np(pthread_self(), sizeof set, &set);
  const int only = sched_getcpu();
  const bool one = CPU_COUNT(&set) == 1;
  CPU_ZERO(&set);
  for (long cpu = 0; cpu < sysconf(_SC_NPROCESSORS_ONLN); ++cpu)
    if (one || cpu == only) CPU_SET(static_cast<std::size_t>(cpu), &set);
  if (pthread_setaffinity_np(pthread_self(), sizeof set, &set) != 0) std::_Exit(EXIT_FAILURE);
}

class System {
 public:
  System(const std::string& fault, int at) : fault_(fault), at_(at) {
    const rclcpp::QoS reliable(kDepth);
    points_ = source_->create_publisher<Int32>("points", reliable);
    objects_ = filter_->create_publisher<Int32>(
        "objects", fault == "qos" ? rclcpp::QoS(reliable).best_effort() : reliable);
    const auto filter = [this](Int32::ConstSharedPtr sample) { filtered(*sample); };
    const auto sink = [this](Int32::ConstSharedPtr sample) { received(*sample); };
    filtering_ = filter_->create_subscription<Int32>("/points", kDepth, filter);
    sinking_ = sink_->create_subscription<Int32>(fault == "remap" ? "elsewhere" : "objects", reliable, sink);
    service_ =
        sink_->create_service<List>("list", [](List::Request::SharedPtr, List::Response::SharedPtr) {});
    client_ = source_->create_client<List>("perception/list");
  }

  ~System() {
    if (publishing_.joinable()) publishing_.join();
  }
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  bool connected() const {
    const bool apart = fault_ == "qos" || fault_ == "remap";
    return points_->get_subscription_count() > 0 && (apart || objects_->get_subscription_count() > 0) &&
           client_->service_is_ready();
  }

  void run(rclcpp::Executor& executor) {
    executor_ = &executor;
    timer_ =
        source_->create_wall_timer(fault_ == "period" ? kPeriod + kPeriod / 10 : kPeriod, [this] { tick(); });
    if (fault_ == "period") report_fault();
    for (const auto& node : {source_, filter_, sink_}) executor.add_node(node);
    executor.spin();
  }

 private:
  void tick() {
    points_->publish(message(++sent_));
    if (sent_ % 5 == 0)
      client_->async_send_request(std::make_shared<List::Request>(),
                                  [](rclcpp::Client<List>::SharedFuture) {});
    if (sent_ != at_) return;
    static const std::map<std::string, std::function<void(System&)>> kFaults = {
        {"burst",
         [](System& s) { s.points_->publish(message(s.sent_)), s.points_->publish(message(s.sent_)); }},
        {"lost",
         [](System& s) {
           for (int i = 0; i < 3 * kDepth; ++i) s.points_->publish(message(s.sent_));
         }},
        {"stop", [](System& s) { s.timer_->cancel(); }},
        {"mute", [](System& s) { s.muted_ = true; }},
        {"slow", [](System& s) { s.work_ = 30 * kPeriod; }},
        {"destroy", [](System& s) { s.sinking_.reset(); }},
        {"unserve", [](System& s) { s.service_.reset(); }},
        {"exchange", [](System& s) { s.exchange_period(); }},
        {"publisher", [](System& s) { s.add_publisher(); }},
        {"node", [](System& s) { s.add_node(); }},
        {"policy", [](System&) { change_policy(); }},
        {"affinity", [](System&) { change_affinity(); }},
        {"killed", [](System&) { std::raise(SIGKILL); }},
        {"stopped", [](System&) { std::raise(SIGSTOP); }},
        {"end", [](System&) { rclcpp::shutdown(); }},
    };
    const auto fault = kFaults.find(fault_);
    if (fault == kFaults.end()) return;
    report_fault();
    fault->second(*this);
  }

  void filtered(const Int32& sample) {
    const bool overrun = fault_ == "overrun" && sample.data == at_;
    if (overrun) report_fault();
    work(overrun ? 4 * kWork * 11 / 10 : work_);
    if (!muted_) objects_->publish(sample);
  }

  void received(const Int32& sample) {
    if (fault_ != "block" || sample.data != at_) return;
    report_fault();
    std::this_thread::sleep_for(10 * kPeriod);
  }

  void exchange_period() {
    std::int64_t old = 0;
    const auto handle = timer_->get_timer_handle();
    if (rcl_timer_exchange_period(handle.get(), (kPeriod * 3 / 2).count(), &old) != RCL_RET_OK) std::abort();
  }

  void add_node() {
    added_ = std::make_shared<rclcpp::Node>("added");
    further_timer_ = added_->create_wall_timer(kPeriod, [] {});
    executor_->add_node(added_);
  }

  /// Of a node that no executor serves; publishes in a thread.
  void add_publisher() {
    added_ = std::make_shared<rclcpp::Node>("added");
    publishing_ = std::thread([this, further = added_->create_publisher<Int32>("points", kDepth)] {
      while (rclcpp::ok()) further->publish(message(0)), std::this_thread::sleep_for(kPeriod);
    });
  }

  const std::string fault_;
  const int at_;
  int sent_ = 0;
  bool muted_ = false;
  Duration work_ = kWork;
  rclcpp::Executor* executor_ = nullptr;
  rclcpp::Node::SharedPtr source_ = std::make_shared<rclcpp::Node>("source");
  rclcpp::Node::SharedPtr filter_ = std::make_shared<rclcpp::Node>("filter", "perception");
  rclcpp::Node::SharedPtr sink_ = std::make_shared<rclcpp::Node>("sink", "perception"), added_;
  rclcpp::Publisher<Int32>::SharedPtr points_, objects_;
  rclcpp::Subscription<Int32>::SharedPtr filtering_, sinking_;
  rclcpp::Service<List>::SharedPtr service_;
  rclcpp::Client<List>::SharedPtr client_;
  rclcpp::TimerBase::SharedPtr timer_, further_timer_;
  std::thread publishing_;
};

/// Many small messages.
void run_load(rclcpp::Executor& executor, int samples, int timers, Duration period) {
  const auto node = std::make_shared<rclcpp::Node>("load");
  int received = 0;
  std::vector<rclcpp::Publisher<Int32>::SharedPtr> publishers;
  std::vector<rclcpp::Subscription<Int32>::SharedPtr> subscriptions;
  std::vector<rclcpp::TimerBase::SharedPtr> wall_timers;
  for (int i = 0; i < timers; ++i) {
    const std::string topic = "load_" + std::to_string(i);
    publishers.push_back(node->create_publisher<Int32>(topic, kDepth));
    subscriptions.push_back(node->create_subscription<Int32>(topic, kDepth, [&](Int32::ConstSharedPtr) {
      if (++received >= samples) rclcpp::shutdown();
    }));
  }
  for (const auto& publisher : publishers) {
    if (!hotpath::test::eventually([&] { return publisher->get_subscription_count() > 0; })) std::abort();
    wall_timers.push_back(node->create_wall_timer(period, [publisher] { publisher->publish(message(0)); }));
  }
  executor.add_node(node);
  executor.spin();
}

/// What a recorder behind LTTng sees that does nothing but read the clock.
void read_clock(int samples) {
  std::vector<long long> instants;
  const int callback = 0;
  for (int i = 0; i < samples; ++i) {
    std::this_thread::sleep_for(5ms);
    TRACETOOLS_TRACEPOINT(callback_start, static_cast<const void*>(&callback), false);
    instants.push_back(now_ns());
    TRACETOOLS_TRACEPOINT(callback_end, static_cast<const void*>(&callback));
    instants.push_back(now_ns());
  }
  for (const long long instant : instants) std::printf("%lld\n", instant);
}

void measure_tracepoints(int bursts) {
  constexpr int kEvents = 1000;
  const int callback = 0;
  std::vector<double> each_ns;
  for (int i = 0; i < bursts; ++i) {
    std::this_thread::sleep_for(20ms);  // the watcher empties the ring
    const long long begin = now_ns();
    for (int event = 0; event < kEvents; event += 2) {
      TRACETOOLS_TRACEPOINT(callback_start, static_cast<const void*>(&callback), false);
      TRACETOOLS_TRACEPOINT(callback_end, static_cast<const void*>(&callback));
    }
    each_ns.push_back(static_cast<double>(now_ns() - begin) / kEvents);
  }
  std::sort(each_ns.begin(), each_ns.end());
  std::printf("a tracepoint: %.1f ns (median of %d bursts), %.1f ns (least), %.1f ns (90th percentile)\n",
              each_ns[each_ns.size() / 2], bursts, each_ns.front(), each_ns[each_ns.size() * 9 / 10]);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4 && argc != 6) return 2;
  rclcpp::init(argc, argv);
  const auto executor = hotpath::test::make_executor(argv[1]);
  const std::string fault = argv[2];
  const int samples = std::atoi(argv[3]);
  if (!executor) return 2;
  if (fault == "clock") {
    read_clock(samples);
  } else if (fault == "cost") {
    measure_tracepoints(samples);
  } else if (argc == 6) {
    run_load(*executor, samples, std::atoi(argv[4]), Duration(1000) * std::atoi(argv[5]));
  } else {
    System system(fault, samples);
    if (!hotpath::test::eventually([&] { return system.connected(); })) return EXIT_FAILURE;
    system.run(*executor);
  }
  rclcpp::shutdown();
  return EXIT_SUCCESS;
}
