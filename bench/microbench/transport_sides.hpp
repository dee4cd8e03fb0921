// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <PayloadPubSubTypes.h>

#include <stdexcept>

#include "hotpath/fastdds/fastdds_transport.hpp"
#include "hotpath/live/intra_process_transport.hpp"
#include "microbench/executor_run.hpp"
#include "microbench/raw_executor.hpp"

namespace hotpath::gbench {

using namespace std::chrono_literals;

inline constexpr const char* kTopic = "payload";
inline constexpr Duration kDiscovery = 10s;
inline constexpr std::uint32_t kDepth = 10;  ///< Enough for a disturbed machine to lose nothing.

template <class M, class P>
struct PayloadTraits {
  using Message = M;
  using PubSubType = P;
  static SampleInfo info(const M& m) { return {from_ns(m.published()), kNever, {0, m.number()}}; }
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

/// This process's share of a path through hotpath: its transport, and an executor for its subscribers.
template <class Traits>
class HotpathSide {
 public:
  using Message = typename Traits::Message;

  explicit HotpathSide(const Plan& plan) : plan_(plan) {
    if (plan.path == Path::intra_process) {
      transport_ = std::make_unique<IntraProcessTransport<Message>>();
    } else {
      transport_ = std::make_unique<FastDdsTransport<Traits>>(plan.fastdds());
    }
  }
  ~HotpathSide() {
    if (live_) {
      live_->executor().stop();
      live_->executor().join();
      live_->executor().close();
    }
    transport_.reset();
  }

  void add_writer() { writer_ = transport_->add_writer(kTopic, kDepth, plan_.subscribers); }
  void add_subscribers() {
    const TaskSet set = subscriptions(plan_.subscribers, kDepth);
    const ExecutorEntry& entry = *find_executor("events-ro");
    live_.emplace(set, entry.make(set, {}), handler_, default_options(entry), plan_.samples() + 1);
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
  NoWork handler_;
  std::optional<LiveRun> live_;
  std::unique_ptr<Transport<Message>> transport_;
  std::uint32_t writer_ = 0;
};

/// The same share with Fast DDS alone.
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

  Message& borrow() {
    void* message = nullptr;
    writer_->loan_sample(message,
                         eprosima::fastdds::dds::DataWriter::LoanInitializationKind::NO_LOAN_INITIALIZATION);
    if (message == nullptr) throw std::runtime_error("Fast DDS lent no sample");
    return *static_cast<Message*>(message);
  }
  void publish(Message& message) { writer_->write(&message); }

 private:
  const Plan plan_;
  std::vector<double> latencies_;
  RawExecutor<Traits> executor_;
  FastDdsParticipant participant_;
  eprosima::fastdds::dds::DataWriter* writer_ = nullptr;
};

}  // namespace hotpath::gbench
