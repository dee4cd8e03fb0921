// SPDX-License-Identifier: Apache-2.0
// Foreign participants on the DDS domain of a run.
//
// dds_partner listen: prints `{"kind": "ready"}`, then one line of JSON for each sample of a live run or a
// replay of one repetition. Ends after its last statistics, or after `--seconds`.
//
// dds_partner strange: publishes payloads of any length and content on a topic, under its type's name, until
// SIGTERM, and prints their number. With --read, it reads reliably and prints `matched` once it has a
// writer. With --spy, it first waits until discovery reveals the run's name of the topic.
#include <TelemetryPubSubTypes.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <fastdds/dds/core/condition/StatusCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "hotpath/fastdds/participant.hpp"

namespace hotpath {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;
using nlohmann::json;

namespace {

struct Arguments {
  FastDdsOptions options;
  double seconds = 60;
  std::string topic, partition = "*";
  bool everywhere = false, spies = false, reads = false;
};

json to_json(const telemetry::RunInfo& m) {
  json nodes = json::array(), chains = json::array();
  for (const auto& n : m.nodes()) nodes.push_back({{"name", n.name()}, {"hot", n.hot()}});
  for (const auto& c : m.chains()) chains.push_back({{"name", c.name()}});
  return {{"kind", "run"},
          {"run_id", m.run_id()},
          {"graph", m.graph()},
          {"executor", m.executor()},
          {"repetition", m.repetition()},
          {"transport", m.transport()},
          {"topic_prefix", m.topic_prefix()},
          {"origin", m.origin()},
          {"epoch_ns", m.epoch_ns()},
          {"facts", json::parse(m.facts())},
          {"nodes", nodes},
          {"chains", chains}};
}

json to_json(const telemetry::Statistics& m) {
  json nodes = json::array(), chains = json::array();
  for (const auto& n : m.nodes()) {
    nodes.push_back({{"ran", n.ran()},
                     {"skipped", n.skipped()},
                     {"overwritten", n.overwritten()},
                     {"overruns", n.overruns()},
                     {"queued", n.queued()}});
  }
  for (const auto& c : m.chains()) {
    chains.push_back({{"samples", c.samples()}, {"latency_max_ns", c.latency_max_ns()}});
  }
  return {{"kind", "statistics"}, {"run_id", m.run_id()},     {"number", m.number()},
          {"last", m.last()},     {"stamp_ns", m.stamp_ns()}, {"run_time_s", m.run_time_s()},
          {"nodes", nodes},       {"chains", chains},         {"samples_lost", m.samples_lost()}};
}

json to_json(const telemetry::ChainSample& m) {
  return {{"kind", "sample"},
          {"run_id", m.run_id()},
          {"chain", m.chain()},
          {"number", m.number()},
          {"job", m.job()},
          {"stamp_ns", m.stamp_ns()},
          {"hot_path_latency_ns", m.hot_path_latency_ns()},
          {"end_to_end_latency_ns", m.end_to_end_latency_ns()}};
}

json to_json(const telemetry::Clock& m) {
  return {{"kind", "clock"}, {"run_id", m.run_id()}, {"time_ns", m.time_ns()}};
}

class Listener {
 public:
  explicit Listener(const Arguments& arguments)
      : arguments_(arguments), participant_(create_participant(arguments.options)) {
    subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    run_ = add<telemetry::RunInfoPubSubType>(telemetry::RUN_TOPIC);
    samples_ = add<telemetry::ChainSamplePubSubType>(telemetry::CHAIN_SAMPLES_TOPIC);
    statistics_ = add<telemetry::StatisticsPubSubType>(telemetry::STATISTICS_TOPIC);
    clock_ = add<telemetry::ClockPubSubType>(telemetry::CLOCK_TOPIC);
  }
  ~Listener() {
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  void run() {
    print({{"kind", "ready"}});
    const auto limit = std::chrono::steady_clock::now() + from_ms(arguments_.seconds * 1000);
    // The last statistics may overtake samples on other topics; these arrive before their writer
    // leaves.
    fast::ConditionSeq active;
    while (!ended_ || publisher_is_there()) {
      const auto left = std::chrono::duration<double>(limit - std::chrono::steady_clock::now()).count();
      if (left <= 0 ||
          something_.wait(active, eprosima::fastrtps::Duration_t(left)) != ReturnCode_t::RETCODE_OK)
        break;
      take_all();
    }
    take_all();
  }

 private:
  template <class PubSubType>
  fast::DataReader* add(const std::string& topic_name) {
    fast::TypeSupport type(new PubSubType);
    type.register_type(participant_);
    fast::DataReaderQos qos;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 4096;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    fast::Topic* topic =
        participant_->create_topic(topic_name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::DataReader* reader = subscriber_->create_datareader(topic, qos);
    fast::StatusCondition& changed = reader->get_statuscondition();
    changed.set_enabled_statuses(fast::StatusMask::data_available()
                                 << fast::StatusMask::subscription_matched());
    something_.attach_condition(changed);
    return reader;
  }

  /// Reading a status resets its condition.
  static void forget_changed_writers(fast::DataReader* reader) {
    fast::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
  }

  bool publisher_is_there() const {
    fast::SubscriptionMatchedStatus status;
    samples_->get_subscription_matched_status(status);
    return status.current_count > 0;
  }

  template <class Message, class Visit>
  static void take(fast::DataReader* reader, Visit visit) {
    Message message;
    fast::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) visit(message);
    }
  }

  void take_all() {
    for (fast::DataReader* reader : {run_, samples_, statistics_, clock_}) forget_changed_writers(reader);
    const auto show = [](const auto& message) { print(to_json(message)); };
    take<telemetry::RunInfo>(run_, show);
    take<telemetry::ChainSample>(samples_, show);
    take<telemetry::Clock>(clock_, show);
    take<telemetry::Statistics>(statistics_, [&](const telemetry::Statistics& message) {
      show(message);
      ended_ = ended_ || message.last();
    });
  }

  static void print(const json& line) { std::cout << line.dump() << std::endl; }

  const Arguments& arguments_;
  fast::DomainParticipant* participant_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
  fast::DataReader *run_ = nullptr, *samples_ = nullptr, *statistics_ = nullptr, *clock_ = nullptr;
  fast::WaitSet something_;  ///< Wakes for data at a reader, or when a writer matches or leaves.
  bool ended_ = false;
};

constexpr timespec kPace{0, 1'000'000};
constexpr const char* kType = "hotpath::msg::Message4kb";

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

/// Publishes or reads among strangers.
void be_strange(Arguments arguments) {
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &end, nullptr);  // inherited by all later threads

  arguments.options.loopback_only = !arguments.everywhere;
  Spy spy(arguments.topic);
  fast::DomainParticipant* participant = create_participant(
      arguments.options.domain, participant_qos(arguments.options), &spy, fast::StatusMask::none());
  meet(*participant, spy, arguments);
  participant->set_listener(nullptr, fast::StatusMask::none());
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

}  // namespace
}  // namespace hotpath

int main(int argc, char** argv) {
  hotpath::Arguments arguments;
  CLI::App app("Foreign participants on the DDS domain of a run");
  app.require_subcommand(1);
  CLI::App* const listen = app.add_subcommand("listen", "Prints what a live run or a replay publishes");
  CLI::App* const strange = app.add_subcommand("strange", "Publishes nonsense, or reads");
  for (CLI::App* const command : {listen, strange}) command->add_option("--domain", arguments.options.domain);
  listen->add_option("--seconds", arguments.seconds);
  strange->add_option("--topic", arguments.topic)->required();
  strange->add_option("--partition", arguments.partition, "DDS partition; empty: the default partition");
  strange->add_flag("--spy", arguments.spies, "Take the topic's name from discovery");
  strange->add_flag("--read", arguments.reads);
  strange->add_flag("--all-interfaces", arguments.everywhere,
                    "Use all network interfaces, not only the loopback");
  CLI11_PARSE(app, argc, argv);
  *listen ? hotpath::Listener(arguments).run() : hotpath::be_strange(arguments);
}
