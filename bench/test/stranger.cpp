// SPDX-License-Identifier: Apache-2.0
// A foreign DDS participant. Publishes payloads of any length and content on a topic, under its
// type's name, until SIGTERM, and prints their number. With --read, it reads reliably and prints
// `matched` once it has a writer. With --spy, it first waits until discovery reveals the run's name
// of the topic.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <mutex>
#include <random>
#include <vector>

#include "hotpath/fastdds/participant.hpp"

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr timespec kPace{0, 1'000'000};
constexpr const char* kType = "hotpath::msg::Message4kb";

struct Arguments {
  hotpath::FastDdsOptions options;
  std::string topic, partition = "*";
  bool everywhere = false, spies = false, reads = false;
};

/// Waits for at most one pace; returns whether SIGTERM came.
bool told_to_end() {
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  return sigtimedwait(&end, nullptr, &kPace) == SIGTERM;
}

/// Sends raw bytes under the name of another type.
class AnyBytes final : public fast::TopicDataType {
 public:
  AnyBytes() {
    setName(kType);
    m_typeSize = kMost;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<std::vector<std::uint8_t>*>(data);
    payload->length = static_cast<std::uint32_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), payload->data);
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return
        [data] { return static_cast<std::uint32_t>(static_cast<std::vector<std::uint8_t>*>(data)->size()); };
  }
  void* createData() override { return new std::vector<std::uint8_t>; }
  void deleteData(void* data) override { delete static_cast<std::vector<std::uint8_t>*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }

  static constexpr std::uint32_t kMost = 8192;
};

/// A random payload; half of the payloads begin like a message of the right size.
std::vector<std::uint8_t> any_payload(std::mt19937_64& random) {
  const bool plausible = random() % 2 == 0;
  std::vector<std::uint8_t> bytes(plausible ? 4100 : random() % AnyBytes::kMost);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : 0xff);
  if (plausible) std::fill_n(bytes.begin(), 4, std::uint8_t{0}), bytes[1] = 1;
  return bytes;
}

/// Reads the topic names of other programs from the discovery traffic.
class Spy final : public fast::DomainParticipantListener {
 public:
  explicit Spy(const std::string& topic) : ending_("/" + topic) {}

  /// The run's name of the topic; empty: not seen yet.
  std::string found() const {
    const std::lock_guard lock(mutex_);
    return found_;
  }

 private:
  void note(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (name.ends_with(ending_)) found_ = name;
  }
  void on_publisher_discovery(fast::DomainParticipant*, rtps::WriterDiscoveryInfo&& writer) override {
    note(writer.info.topicName().to_string());
  }
  void on_subscriber_discovery(fast::DomainParticipant*, rtps::ReaderDiscoveryInfo&& reader) override {
    note(reader.info.topicName().to_string());
  }

  const std::string ending_;
  mutable std::mutex mutex_;
  std::string found_;
};

void publish(fast::DomainParticipant& participant, fast::Topic* topic, const Arguments& arguments) {
  fast::PublisherQos publisher;
  if (!arguments.partition.empty()) publisher.partition().push_back(arguments.partition.c_str());
  fast::DataWriterQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  fast::DataWriter* writer = participant.create_publisher(publisher)->create_datawriter(topic, qos);
  std::mt19937_64 random(1);
  unsigned long count = 0;
  while (count % 16 != 0 || !told_to_end()) {
    std::vector<std::uint8_t> payload = any_payload(random);
    count += writer->write(&payload);
  }
  std::printf("%lu\n", count);
}

void read(fast::DomainParticipant& participant, fast::Topic* topic, const Arguments& arguments) {
  fast::SubscriberQos subscriber;
  subscriber.partition().push_back(arguments.partition.c_str());
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  fast::DataReader* reader = participant.create_subscriber(subscriber)->create_datareader(topic, qos);
  for (bool said = false; !told_to_end();) {
    fast::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
    if (said || status.current_count == 0) continue;
    said = std::puts("matched") >= 0 && std::fflush(stdout) == 0;
  }
}

/// Publishes or reads until SIGTERM.
void meet(fast::DomainParticipant& participant, const Spy& spy, const Arguments& arguments) {
  std::string name = arguments.topic;
  while (arguments.spies && (name = spy.found()).empty()) {
    if (told_to_end()) return;
  }
  fast::TypeSupport(new AnyBytes).register_type(&participant);
  fast::Topic* topic = participant.create_topic(name, kType, fast::TOPIC_QOS_DEFAULT);
  (arguments.reads ? read : publish)(participant, topic, arguments);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Publishes nonsense, or reads");
  app.add_option("--domain", arguments.options.domain);
  app.add_option("--topic", arguments.topic)->required();
  app.add_option("--partition", arguments.partition, "DDS partition; empty: the default partition");
  app.add_flag("--spy", arguments.spies, "Take the topic's name from discovery");
  app.add_flag("--read", arguments.reads);
  app.add_flag("--all-interfaces", arguments.everywhere, "Use all network interfaces, not only the loopback");
  CLI11_PARSE(app, argc, argv);
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &end, nullptr);  // inherited by all later threads

  arguments.options.loopback_only = !arguments.everywhere;
  Spy spy(arguments.topic);
  fast::DomainParticipant* participant = hotpath::create_participant(
      arguments.options.domain, hotpath::participant_qos(arguments.options), &spy, fast::StatusMask::none());
  meet(*participant, spy, arguments);
  participant->set_listener(nullptr, fast::StatusMask::none());
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
