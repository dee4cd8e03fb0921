// SPDX-License-Identifier: Apache-2.0
// A DDS participant that is none of ours: publishes on a topic of a run, in its partition and under its
// type's name, payloads of any length and content, until it is told to end. Prints how many.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <random>
#include <vector>

#include "hotpath/fastdds/participant.hpp"

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// Bytes as they are, under the name of another type.
class AnyBytes final : public fast::TopicDataType {
 public:
  explicit AnyBytes(const std::string& name) {
    setName(name.c_str());
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

/// Half of them begin like a message of the right size.
std::vector<std::uint8_t> any_payload(std::mt19937_64& random, std::size_t size) {
  const bool plausible = random() % 2 == 0;
  std::vector<std::uint8_t> bytes(plausible ? size : random() % AnyBytes::kMost);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : 0xff);
  if (plausible) std::fill_n(bytes.begin(), 4, std::uint8_t{0}), bytes[1] = 1;
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  hotpath::FastDdsOptions options;
  options.partition = "hotpath-*";
  std::string topic, type = "hotpath::msg::Message4kb";
  std::size_t size = 4100;
  CLI::App app("Publishes nonsense");
  app.add_option("--domain", options.domain);
  app.add_option("--topic", topic)->required();
  app.add_option("--type", type);
  app.add_option("--size", size, "Of half of the payloads");
  app.add_option("--partition", options.partition, "Empty: the default one");
  bool everywhere = false;
  app.add_flag("--all-interfaces", everywhere, "Not on this machine alone");
  CLI11_PARSE(app, argc, argv);
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &end, nullptr);  // in all threads that come from here

  options.loopback_only = !everywhere;
  fast::DomainParticipant* participant = hotpath::create_participant(options);
  fast::TypeSupport(new AnyBytes(type)).register_type(participant);
  fast::PublisherQos publisher;
  if (!options.partition.empty()) publisher.partition().push_back(options.partition.c_str());
  fast::DataWriterQos writer_qos;
  writer_qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  writer_qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
  writer_qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  fast::DataWriter* writer = participant->create_publisher(publisher)->create_datawriter(
      participant->create_topic(topic, type, fast::TOPIC_QOS_DEFAULT), writer_qos);
  std::mt19937_64 random(1);
  unsigned long count = 0;
  constexpr timespec kPace{0, 1'000'000};
  while (count % 16 != 0 || sigtimedwait(&end, nullptr, &kPace) != SIGTERM) {
    std::vector<std::uint8_t> payload = any_payload(random, size);
    count += writer->write(&payload);
  }
  std::printf("%lu\n", count);
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
