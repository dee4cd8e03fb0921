// SPDX-License-Identifier: Apache-2.0
// One-way latency (publication to start of the callback) and CPU time of a message of 4 KiB over
// Fast DDS, by path. The yardstick is Fast DDS alone with the same threads.
#include <Message4kbPubSubTypes.h>

#include <array>
#include <condition_variable>
#include <deque>
#include <mutex>

#include "hotpath/fastdds/fastdds_transport.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "microbench/executor_run.hpp"
#include "program/text.hpp"

namespace hotpath::microbench {
namespace {

namespace dds = eprosima::fastdds::dds;
using Kind = ChannelMessage::Kind;
using Message = msg::Message4kb;

constexpr const char* kTopic = "payload";
constexpr Duration kDiscovery = 10s, kPeriod = 1ms;
constexpr std::uint32_t kDepth = 10;  ///< Prevents losses on a disturbed machine.

/// Measured messages, and those of the warm-up before them.
struct Plan {
  FastDdsOptions options;
  int messages = 0;

  int warm_up() const { return messages / 5; }
  int all() const { return messages + warm_up(); }
};

/// The instant of publication, which is all that a message has.
struct Payload {
  using Message = msg::Message4kb;
  using PubSubType = msg::Message4kbPubSubType;
  static SampleInfo info(const Message& m) { return {from_ns(m.data()[1]), kNever, {}}; }
  static bool valid(const Message&, TaskId) { return true; }
};

/// This process's part of a path through hotpath: a transport, and an executor for the subscriber.
class HotpathSide {
 public:
  explicit HotpathSide(const Plan& plan) : records_(plan.all() + 1), transport_(plan.options, 1) {
    subscription_.tasks.resize(1);
    subscription_.tasks[0].kind = TaskKind::subscription;
    subscription_.tasks[0].depth = kDepth;
  }
  ~HotpathSide() {
    if (!live_) return;
    live_->executor().stop();
    live_->executor().close(live_->executor().join());
  }

  void add_writer() { writer_ = transport_.add_writer(kTopic, kDepth, 1); }
  void add_subscriber() {
    const setup::ExecutorSpec executor = setup::parse_executor("events-ro", {});
    live_ = std::make_unique<LiveRun>(subscription_, executor, default_options(*executor.entry), records_);
    transport_.add_reader(kTopic, 0, kDepth, 1, live_->executor());
  }
  void wait_until_matched() { transport_.wait_until_matched(now() + kDiscovery); }
  void start() { live_->executor().start(now(), kNever - 1h); }
  std::vector<double> stop() {
    live_->executor().stop();
    live_->executor().join();
    return live_->of_jobs([](const JobRecord& r) { return ns(r.lateness()); });
  }

  Message& borrow() { return transport_.borrow(writer_); }
  void publish(Message& message) { transport_.publish(writer_, message, Payload::info(message)); }

 private:
  const std::uint64_t records_;
  TaskSet subscription_;
  std::unique_ptr<LiveRun> live_;
  FastDdsTransport<Payload> transport_;
  std::uint32_t writer_ = 0;
};

/// The same part with Fast DDS alone: a listener passes loaned samples to one thread, which handles
/// them in order. FastDdsParticipant sets up participant and endpoints, so that all settings are
/// the same.
class RawSide final : dds::DataReaderListener {
 public:
  explicit RawSide(const Plan& plan) : participant_(plan.options) {
    latencies_.reserve(static_cast<std::size_t>(plan.all()));
    participant_.register_type(dds::TypeSupport(new Payload::PubSubType));
    for (Loan& loan : loans_) unused_.push_back(&loan);
  }
  ~RawSide() override { static_cast<void>(stop()); }

  void add_writer() { writer_ = participant_.add_writer(kTopic, kDepth, 1); }
  void add_subscriber() { reader_ = participant_.add_reader(kTopic, kDepth, 1, this); }
  void wait_until_matched() { participant_.wait_until_matched(now() + kDiscovery); }
  void start() {
    thread_ = std::thread([this] { work(); });
  }
  std::vector<double> stop() {
    if (thread_.joinable()) {
      {
        const std::lock_guard lock(mutex_);
        stop_ = true;
      }
      arrived_.notify_one();
      thread_.join();
    }
    return latencies_;
  }

  Message& borrow() {
    void* message = nullptr;
    writer_->loan_sample(message, dds::DataWriter::LoanInitializationKind::NO_LOAN_INITIALIZATION);
    if (message == nullptr) throw std::runtime_error("Fast DDS lent no sample");
    return *static_cast<Message*>(message);
  }
  void publish(Message& message) { writer_->write(&message); }

 private:
  struct Loan {
    dds::LoanableSequence<Message> data;
    dds::SampleInfoSeq infos;
  };

  void on_data_available(dds::DataReader* reader) override {
    Loan* loan = nullptr;
    {
      const std::lock_guard lock(mutex_);
      if (unused_.empty()) return;  // the thread is far behind; a later call takes the sample
      loan = unused_.back();
      unused_.pop_back();
    }
    const bool taken =
        reader->take(loan->data, loan->infos) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
    bool sleeper = false;
    {
      const std::lock_guard lock(mutex_);
      (taken ? queue_ : unused_).push_back(loan);
      sleeper = taken && std::exchange(sleeping_, false);
    }
    if (sleeper) arrived_.notify_one();
  }

  void work() {
    minimise_timer_slack();
    std::unique_lock lock(mutex_);
    while (!stop_) {
      if (queue_.empty()) {
        sleeping_ = true;
        arrived_.wait(lock);
        sleeping_ = false;
        continue;
      }
      Loan* loan = queue_.front();
      queue_.pop_front();
      lock.unlock();
      for (std::int32_t i = 0; i < loan->infos.length(); ++i) {
        if (loan->infos[i].valid_data)
          latencies_.push_back(ns(now() - Payload::info(loan->data[i]).published));
      }
      reader_->return_loan(loan->data, loan->infos);
      lock.lock();
      unused_.push_back(loan);
    }
  }

  std::vector<double> latencies_;
  std::array<Loan, kDepth + 2> loans_;
  std::deque<Loan*> unused_, queue_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  bool sleeping_ = false, stop_ = false;
  std::thread thread_;
  FastDdsParticipant participant_;
  dds::DataWriter* writer_ = nullptr;
  dds::DataReader* reader_ = nullptr;
};

/// Returns the CPU time of this process after the warm-up.
template <class Side>
Duration publish_all(Side& side, const Plan& plan) {
  minimise_timer_slack();
  Duration before{};
  Time next = now() + 5ms;
  for (int i = 0; i < plan.all(); ++i) {
    if (i == plan.warm_up()) before = process_cpu_time();
    sleep_until(next);
    Message& message = side.borrow();
    message.data()[1] = to_ns(now());
    side.publish(message);
    next = std::max(next + kPeriod, now() + kPeriod / 2);  // prevents bursts after a delay
  }
  std::this_thread::sleep_for(20ms);  // for the last messages to arrive
  return process_cpu_time() - before;
}

Measurement measurement_of(std::vector<double> latencies, const Plan& plan) {
  const double median = warm_median(std::move(latencies), static_cast<double>(plan.warm_up()) / plan.all());
  return {median, {{"latency_p50_ns", median}}};
}

template <class Side>
Measurement in_one_process(const Plan& plan) {
  Side side(plan);
  side.add_subscriber();
  side.add_writer();
  side.wait_until_matched();
  side.start();
  const Duration cpu = publish_all(side, plan);
  Measurement found = measurement_of(side.stop(), plan);
  found.counters["cpu_per_message_ns"] = ns(cpu) / plan.messages;
  return found;
}

/// The subscriber in this process, the publisher in another.
template <class Side>
Measurement in_two_processes(const Plan& plan) {
  const ForkedProcess publisher = fork_process([&](const Channel& subscriber) {
    try {
      Side side(plan);
      side.add_writer();
      side.wait_until_matched();
      publish_all(side, plan);
      subscriber.send(Kind::done);
      static_cast<void>(subscriber.receive(now() + 1h));  // until the subscriber has stopped
    } catch (const std::exception&) {  // the subscriber's process is gone, or notices the closed channel
    }
    return 0;
  });
  if (publisher.id < 0) throw std::runtime_error("cannot start the publishing process");
  Side side(plan);
  side.add_subscriber();
  side.start();
  side.wait_until_matched();
  const auto message = publisher.channel.receive(now() + 1h);
  if (!message || message->kind == Kind::closed) throw std::runtime_error("the publishing process died");
  Measurement found = measurement_of(side.stop(), plan);
  publisher.channel.send(Kind::stop);
  waitpid(publisher.id, nullptr, 0);
  return found;
}

template <class Side>
void add_path(const std::string& path, const char* who, const Plan& plan) {
  const auto measure = path == "fastdds_in_process" ? in_one_process<Side> : in_two_processes<Side>;
  register_isolated(program::concat("one_way/", path, "/kib:4/subscribers:1/", who),
                    [=] { return measure(plan); });
}

}  // namespace

void register_all(bool quick) {
  Plan plan;
  plan.options.partition = "bench-transport";
  plan.messages = quick ? 100 : 400;
  for (const char* path : {"fastdds_in_process", "fastdds_shared_memory", "fastdds_udp"}) {
    Plan of_path = plan;
    if (std::string_view(path) == "fastdds_shared_memory") {
      of_path.options.network = FastDdsOptions::Network::shared_memory;
    }
    add_path<HotpathSide>(path, "hotpath", of_path);
    add_path<RawSide>(path, "raw_fastdds", of_path);
  }
}

}  // namespace hotpath::microbench
