// SPDX-License-Identifier: Apache-2.0
// One-way latency (publication to start of the callback) and CPU time per message of every transport. The
// yardstick of each path over Fast DDS is Fast DDS alone with the same threads. Then a whole graph.
#include <PayloadPubSubTypes.h>
#include <sys/wait.h>

#include <array>
#include <optional>

#include "hotpath/fastdds/fastdds_transport.hpp"
#include "hotpath/live/intra_process_transport.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "microbench/executor_run.hpp"
#include "microbench/raw_executor.hpp"
#include "microbench/raw_graph.hpp"
#include "program/text.hpp"

namespace hotpath::microbench {
namespace {

using Kind = ChannelMessage::Kind;

constexpr const char* kTopic = "payload";
constexpr Duration kDiscovery = 10s;
constexpr std::uint32_t kDepth = 10;  ///< Prevents losses on a disturbed machine.

template <class M, class P>
struct PayloadTraits {
  using Message = M;
  using PubSubType = P;
  static SampleInfo info(const M& m) { return {from_ns(m.published()), kNever, {0, m.number()}}; }
  static bool valid(const M&, TaskId) { return true; }
};
using Payload4k = PayloadTraits<msg::Payload4k, msg::Payload4kPubSubType>;
using Payload64k = PayloadTraits<msg::Payload64k, msg::Payload64kPubSubType>;
using Payload256k = PayloadTraits<msg::Payload256k, msg::Payload256kPubSubType>;
using Payload1m = PayloadTraits<msg::Payload1m, msg::Payload1mPubSubType>;

enum class Path { intra_process, fastdds_in_process, fastdds_shared_memory, fastdds_udp };

struct Plan {
  Path path = Path::intra_process;
  std::uint32_t subscribers = 1;
  int messages = 0;
  Duration period = 1ms;

  int warm_up() const { return messages / 5; }
  std::size_t samples() const { return static_cast<std::size_t>(messages + warm_up()) * subscribers; }
  FastDdsOptions fastdds() const {
    FastDdsOptions options;
    options.partition = "bench-transport";
    if (path == Path::fastdds_shared_memory) options.network = FastDdsOptions::Network::shared_memory;
    return options;
  }
};

/// This process's part of a path through hotpath: a transport, and an executor for the subscribers.
template <class Traits>
class HotpathSide {
 public:
  using Message = typename Traits::Message;

  explicit HotpathSide(const Plan& plan) : plan_(plan) {
    if (plan.path == Path::intra_process) {
      transport_ = std::make_unique<IntraProcessTransport<Message>>();
    } else {
      transport_ = std::make_unique<FastDdsTransport<Traits>>(plan.fastdds(), plan.subscribers);
    }
  }
  ~HotpathSide() {
    if (live_) {
      live_->executor().stop();
      live_->executor().close(live_->executor().join());
    }
    transport_.reset();
  }

  void add_writer() { writer_ = transport_->add_writer(kTopic, kDepth, plan_.subscribers); }
  void add_subscribers() {
    const TaskSet set = subscriptions(plan_.subscribers, kDepth);
    const ExecutorEntry& entry = *find_executor("events-ro");
    live_.emplace(set, entry.make(set, {}), no_work(), default_options(entry), plan_.samples() + 1);
    for (TaskId id = 0; id < set.size(); ++id) {
      transport_->add_reader(kTopic, id, kDepth, 1, live_->executor());
    }
  }
  void wait_until_matched() { transport_->wait_until_matched(now() + kDiscovery); }
  void start() { live_->executor().start(now(), kNever - 1h); }
  std::vector<double> stop() {
    live_->executor().stop();
    live_->executor().join();
    return live_->of_jobs([](const JobRecord& r) { return ns(r.start - r.job.timestamp); });
  }

  Message& borrow() { return transport_->borrow(writer_); }
  void publish(Message& message) { transport_->publish(writer_, message, Traits::info(message)); }

 private:
  const Plan plan_;
  std::optional<LiveRun> live_;
  std::unique_ptr<Transport<Message>> transport_;
  std::uint32_t writer_ = 0;
};

/// The same part with Fast DDS alone.
template <class Traits>
class RawSide {
 public:
  using Message = typename Traits::Message;

  explicit RawSide(const Plan& plan) : plan_(plan), participant_(plan.fastdds()) {
    latencies_.reserve(plan.samples());
    participant_.register_type(eprosima::fastdds::dds::TypeSupport(new typename Traits::PubSubType));
  }
  void add_writer() { writer_ = participant_.add_writer(kTopic, kDepth, plan_.subscribers); }
  void add_subscribers() {
    for (std::uint32_t i = 0; i < plan_.subscribers; ++i) {
      executor_.add_reader(participant_, kTopic, kDepth, 1, [this](const Message& message) {
        const Time start = now();
        if (latencies_.size() < latencies_.capacity()) {
          latencies_.push_back(ns(start - Traits::info(message).published));
        }
      });
    }
  }
  void wait_until_matched() { participant_.wait_until_matched(now() + kDiscovery); }
  void start() { executor_.start(); }
  std::vector<double> stop() {
    executor_.stop();
    return latencies_;
  }

  Message& borrow() { return *static_cast<Message*>(borrow_raw(*writer_)); }
  void publish(Message& message) { writer_->write(&message); }

 private:
  const Plan plan_;
  std::vector<double> latencies_;
  RawExecutor<Message> executor_;
  FastDdsParticipant participant_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

/// Publishes the plan's messages at its rate; returns the CPU time that the process used after the
/// warm-up.
template <class Side>
Duration publish_all(Side& side, const Plan& plan, const std::function<void()>& warm) {
  minimise_timer_slack();
  Duration before{};
  Time next = now() + 5ms;
  for (int i = 0; i < plan.messages + plan.warm_up(); ++i) {
    if (i == plan.warm_up()) {
      warm();
      before = process_cpu_time();
    }
    sleep_until(next);
    auto& message = side.borrow();
    message.number(static_cast<std::uint64_t>(i));
    message.published(to_ns(now()));
    side.publish(message);
    // Prevents bursts after a delay.
    next = std::max(next + plan.period, now() + plan.period / 2);
  }
  std::this_thread::sleep_for(20ms);  // for the last messages to arrive
  return process_cpu_time() - before;
}

Measurement measurement_of(std::vector<double> latencies, Duration cpu, const Plan& plan) {
  const double arrived = static_cast<double>(latencies.size()) / static_cast<double>(plan.samples());
  const double share = static_cast<double>(plan.warm_up()) / (plan.messages + plan.warm_up());
  Measurement found;
  found.add_samples("latency", warm(std::move(latencies), share));
  found.counters["cpu_per_message_ns"] = ns(cpu) / plan.messages;
  found.counters["arrived_percent"] = 100 * arrived;
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

std::int64_t hear(const Channel& publisher) {
  const auto message = publisher.receive(now() + 1h);
  if (!message || message->kind == Kind::closed) throw std::runtime_error("the publishing process died");
  return message->number[0];
}

/// Subscribers in this process, the publisher in another.
template <class Side>
Measurement in_two_processes(const Plan& plan) {
  const ForkedProcess publisher = fork_process([&](const Channel& subscribers) {
    try {
      Side side(plan);
      side.add_writer();
      side.wait_until_matched();
      const Duration cpu = publish_all(side, plan, [&] { subscribers.send(Kind::begun); });
      subscribers.send({Kind::done, {cpu.count()}});
      hear(subscribers);
    } catch (const std::exception&) {  // the subscribers' process is gone, or notices the closed channel
    }
    return 0;
  });
  if (publisher.id < 0) throw std::runtime_error("cannot start the publishing process");
  Measurement found;
  {
    Side side(plan);
    side.add_subscribers();
    side.start();
    side.wait_until_matched();
    hear(publisher.channel);
    const Duration before = process_cpu_time();
    const Duration theirs(hear(publisher.channel));
    const Duration cpu = process_cpu_time() - before + theirs;
    found = measurement_of(side.stop(), cpu, plan);
    publisher.channel.send(Kind::stop);
  }
  waitpid(publisher.id, nullptr, 0);
  return found;
}

template <class Side>
void add(const std::string& name, const Plan& plan) {
  const bool two = plan.path == Path::fastdds_shared_memory || plan.path == Path::fastdds_udp;
  const auto measure = two ? in_two_processes<Side> : in_one_process<Side>;
  register_isolated(name, [=] { return measure(plan); })->Unit(benchmark::kMicrosecond);
}

template <class Traits>
void add_path(const char* path_name, Path path, std::uint32_t subscribers, bool quick) {
  Plan plan;
  plan.path = path;
  plan.subscribers = subscribers;
  const auto kib = sizeof(typename Traits::Message) / 1024;
  plan.period = 1ms * std::max<std::int64_t>(1, std::max<std::int64_t>(kib / 64, subscribers / 10));
  // About the same time for all plans, with enough messages for a median.
  plan.messages = static_cast<int>(std::clamp<std::int64_t>((quick ? 100ms : 400ms) / plan.period, 30, 400));
  const std::string name = program::concat("one_way/", path_name, "/kib:", kib, "/subscribers:", subscribers);
  add<HotpathSide<Traits>>(name + "/hotpath", plan);
  if (path != Path::intra_process) add<RawSide<Traits>>(name + "/raw_fastdds", plan);
}

}  // namespace

void register_all(bool quick) {
  const std::array paths = {std::pair{"intra_process", Path::intra_process},
                            std::pair{"fastdds_in_process", Path::fastdds_in_process},
                            std::pair{"fastdds_shared_memory", Path::fastdds_shared_memory},
                            std::pair{"fastdds_udp", Path::fastdds_udp}};
  for (const auto& [name, path] : paths) {
    for (const std::uint32_t subscribers : {1U, 10U, 100U})
      add_path<Payload4k>(name, path, subscribers, quick);
    add_path<Payload64k>(name, path, 1, quick);
    add_path<Payload256k>(name, path, 1, quick);
    add_path<Payload1m>(name, path, 1, quick);
  }
  register_isolated("callback/raw_fastdds", [=] {
    return raw_callback(Plan{}.fastdds(), quick ? 1s : 2300ms);
  })->Unit(benchmark::kMicrosecond);
}

}  // namespace hotpath::microbench
