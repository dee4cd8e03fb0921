// SPDX-License-Identifier: Apache-2.0
// Measures the bridge's latency and loss: sends numbered samples on Fast DDS at given rates and
// sizes, and receives them as a ROS 1 subscriber. The latency spans from before DDS's write() to
// the ROS callback. Prints one JSON object per combination.
#include <TelemetryPubSubTypes.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <ros/ros.h>
#include <std_msgs/UInt8MultiArray.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace hotpath {

namespace dds = eprosima::fastdds::dds;
using namespace std::chrono_literals;

namespace {

constexpr const char* kTopic = "bench_bridge";

struct Stamp {
  std::uint64_t number;
  std::int64_t sent_ns;
  std::uint64_t cell;  // the combination of rate and size
};

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

void sleep_until(std::int64_t ns) {
  const timespec t{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

class Sender {
 public:
  explicit Sender(std::uint32_t domain) {
    dds::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    qos.transport().user_transports.push_back(udp);
    qos.allocation().send_buffers.dynamic = true;
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("Fast DDS could not create a participant");
    dds::TypeSupport type(new telemetry::BytesPubSubType);
    type->auto_fill_type_information(false);
    type->auto_fill_type_object(false);
    type.register_type(participant_);
    auto* topic = participant_->create_topic(kTopic, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    dds::DataWriterQos writer;
    writer.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    writer.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    writer.history().depth = 1024;
    writer.data_sharing().off();
    writer.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    // Samples lost to a full socket buffer are requested again within this time.
    writer.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0, 20'000'000);
    writer_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, writer);
  }

  ~Sender() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  bool has_reader() const {
    dds::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count > 0;
  }

  void send(Stamp stamp) {
    std::memcpy(sample_.data().data(), &stamp, sizeof stamp);
    writer_->write(&sample_);
  }

  void set_size(std::size_t bytes) { sample_.data().assign(std::max(bytes, sizeof(Stamp)), 0); }

 private:
  dds::DomainParticipant* participant_ = nullptr;
  dds::DataWriter* writer_ = nullptr;
  telemetry::Bytes sample_;
};

class Receiver {
 public:
  Receiver() {
    subscriber_ = node_.subscribe<std_msgs::UInt8MultiArray>(
        std::string("hotpath/bytes/") + kTopic, 100000, [this](const auto& message) { receive(*message); },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  }

  bool has_publisher() const { return subscriber_.getNumPublishers() > 0; }

  void begin(std::uint64_t cell, std::size_t count) {
    const std::lock_guard<std::mutex> lock(mutex_);
    cell_ = cell;
    latencies_.clear();
    latencies_.reserve(count);
    disordered_ = 0;
  }

  /// Latencies in order of arrival; returns after `count` samples or 3 s without one.
  std::vector<std::int64_t> wait(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    while (latencies_.size() < count && arrived_.wait_for(lock, 3s) == std::cv_status::no_timeout) {
    }
    return latencies_;
  }

  std::uint64_t disordered() const { return disordered_; }
  std::int64_t last_ns() const { return last_ns_; }

 private:
  void receive(const std_msgs::UInt8MultiArray& message) {
    const std::int64_t now = now_ns();
    Stamp stamp{};
    std::memcpy(&stamp, message.data.data(), sizeof stamp);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stamp.cell != cell_) return;
    if (!latencies_.empty() && stamp.number <= last_number_) ++disordered_;
    last_number_ = stamp.number;
    last_ns_ = now;
    latencies_.push_back(now - stamp.sent_ns);
    arrived_.notify_one();
  }

  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<std::int64_t> latencies_;
  std::uint64_t cell_ = 0, last_number_ = 0, disordered_ = 0;
  std::int64_t last_ns_ = 0;
};

double us(const std::vector<std::int64_t>& sorted, double share) {
  if (sorted.empty()) return -1;
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5);
  return static_cast<double>(sorted[rank]) / 1e3;
}

void measure(Sender& sender, Receiver& receiver, std::uint64_t cell, double rate, std::size_t bytes,
             double seconds) {
  const auto count = std::max<std::size_t>(20, static_cast<std::size_t>(rate * seconds));
  const auto period = static_cast<std::int64_t>(1e9 / rate);
  receiver.begin(cell, count);
  sender.set_size(bytes);
  const std::int64_t begin = now_ns() + 10'000'000;
  for (std::size_t i = 0; i < count; ++i) {
    sleep_until(begin + static_cast<std::int64_t>(i) * period);
    sender.send({i, now_ns(), cell});
  }
  const std::int64_t end = now_ns();
  std::vector<std::int64_t> latencies = receiver.wait(count);
  std::sort(latencies.begin(), latencies.end());
  const double sent_s = static_cast<double>(end - begin) / 1e9;
  const double received_s = static_cast<double>(receiver.last_ns() - begin) / 1e9;
  std::cout << "{\"rate_hz\": " << rate << ", \"payload_bytes\": " << bytes << ", \"sent\": " << count
            << ", \"lost\": "
            << static_cast<std::int64_t>(count) - static_cast<std::int64_t>(latencies.size())
            << ", \"disordered\": " << receiver.disordered()
            << ", \"sent_hz\": " << static_cast<double>(count) / sent_s
            << ", \"received_hz\": " << static_cast<double>(latencies.size()) / std::max(received_s, 1e-9)
            << ", \"median_us\": " << us(latencies, 0.5) << ", \"p99_us\": " << us(latencies, 0.99)
            << ", \"max_us\": " << us(latencies, 1) << "}" << std::endl;
}

template <class Condition>
void wait_until(Condition condition, const std::string& what) {
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error(what);
    std::this_thread::sleep_for(10ms);
  }
}

int bench_bridge(int argc, char** argv) {
  ros::init(argc, argv, "bench_bridge", ros::init_options::AnonymousName);
  CLI::App app(
      "Measures latency and loss from Fast DDS to a ROS 1 subscriber, through a bridge that runs with "
      "`_bytes_topics:=bench_bridge`.",
      "bench_bridge");
  std::uint32_t domain = 0;
  std::vector<double> rates{10, 100, 1000, 2000, 5000};
  std::vector<std::size_t> payloads{64, 1024, 4096, 65536, 262144, 1048576};
  double seconds = 3, most_mb = 200;
  app.add_option("--domain", domain, "DDS domain of the bridge")->check(CLI::Range(0, 232));
  app.add_option("--rates", rates, "samples per second")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--payloads", payloads, "bytes")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--seconds", seconds, "for each combination")->check(CLI::PositiveNumber);
  app.add_option("--most-mb-per-s", most_mb, "skips combinations above this throughput")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    Sender sender(domain);
    Receiver receiver;
    ros::AsyncSpinner spinner(1);
    spinner.start();
    wait_until([&] { return sender.has_reader(); },
               "no bridge reads the DDS topic in this domain; start it with _bytes_topics:=bench_bridge");
    wait_until([&] { return receiver.has_publisher(); },
               "no bridge publishes the ROS topic at this master; check ROS_MASTER_URI");
    std::uint64_t cell = 0;
    measure(sender, receiver, ++cell, 500, 4096, 1);  // warm-up; bench_bridge.py skips its line
    for (const std::size_t bytes : payloads) {
      for (const double rate : rates) {
        if (rate * static_cast<double>(bytes) <= most_mb * 1e6) {
          measure(sender, receiver, ++cell, rate, bytes, seconds);
        }
      }
    }
  } catch (const std::exception& e) {
    std::cerr << "bench_bridge: " << e.what() << '\n';
    return 1;
  }
  return 0;
}

}  // namespace

}  // namespace hotpath

int main(int argc, char** argv) { return hotpath::bench_bridge(argc, argv); }
