// SPDX-License-Identifier: Apache-2.0
#include "hotpath/fastdds/participant.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <regex>

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
namespace fastrtps = eprosima::fastrtps::rtps;

namespace {

// Fast DDS logs to standard output by default, which is reserved for our results.
void log_to_standard_error() {
  dds::Log::ClearConsumers();
  auto consumer = std::make_unique<dds::StdoutErrConsumer>();
  consumer->stderr_threshold(dds::Log::Kind::Info);
  dds::Log::RegisterConsumer(std::move(consumer));
  dds::Log::SetVerbosity(dds::Log::Kind::Error);
  // This category logs every oversized sample of an unmatched writer; the transport counts the
  // samples that it rejects.
  dds::Log::SetCategoryFilter(std::regex("^(?!RTPS_READER_HISTORY)"));
}

/// The mark by which participants of one run recognise each other in discovery.
std::string run_mark(const FastDdsOptions& options) {
  return "hotpath:" + options.partition + ":" + options.topic_prefix;
}

template <class Qos>
Qos reliable(std::uint32_t depth) {
  Qos qos;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = static_cast<std::int32_t>(depth);
  qos.data_sharing().off();
  return qos;
}

}  // namespace

dds::DomainParticipantQos participant_qos(const FastDdsOptions& options) {
  dds::DomainParticipantQos qos;
  qos.name("hotpath");
  qos.transport().use_builtin_transports = false;
  if (options.network == FastDdsOptions::Network::shared_memory) {
    qos.transport().user_transports.push_back(std::make_shared<rtps::SharedMemTransportDescriptor>());
  }
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  if (options.loopback_only) udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().user_transports.push_back(udp);
  // The default pool of send buffers has a fixed size, and a writer waits for ever when it is
  // empty.
  qos.allocation().send_buffers.dynamic = true;
  return qos;
}

dds::DomainParticipant* create_participant(std::uint32_t domain, const dds::DomainParticipantQos& qos,
                                           dds::DomainParticipantListener* listener,
                                           const dds::StatusMask& events) {
  log_to_standard_error();
  auto* factory = dds::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(domain, qos, listener, events);
  if (participant == nullptr) {
    throw TransportError(
        "Fast DDS could not create a participant in domain " + std::to_string(domain) +
        "; see its message above; common causes are a missing network interface (is `lo` up?) and a "
        "domain outside 0 to 232");
  }
  return participant;
}

dds::DomainParticipant* create_participant(const FastDdsOptions& options) {
  dds::DomainParticipantQos qos = participant_qos(options);
  // A new participant may miss the answer to its first announcement. It then waits for the next
  // announcement of the missed participant: three seconds by default.
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = {1, 0};
  return create_participant(options.domain, qos);
}

/// Counts, for each endpoint, the matched endpoints of the run's own participants.
class FastDdsParticipant::Partners final : public dds::DomainParticipantListener {
 public:
  explicit Partners(const FastDdsOptions& options) : mark_(run_mark(options)) {}

  void add_participant(const fastrtps::GuidPrefix_t& prefix) {
    const std::lock_guard lock(mutex_);
    run_.insert(prefix);
  }
  bool contains(const fastrtps::GuidPrefix_t& prefix) const {
    const std::lock_guard lock(mutex_);
    return run_.count(prefix) != 0;
  }
  std::int32_t of(const dds::DomainEntity* endpoint) const {
    const std::lock_guard lock(mutex_);
    const auto entry = count_.find(endpoint);
    return entry == count_.end() ? 0 : entry->second;
  }

  void on_participant_discovery(dds::DomainParticipant*, fastrtps::ParticipantDiscoveryInfo&& info) override {
    const auto& data = info.info.m_userData.data_vec();
    if (std::equal(data.begin(), data.end(), mark_.begin(), mark_.end())) {
      add_participant(info.info.m_guid.guidPrefix);
    }
  }
  void on_publication_matched(dds::DataWriter* writer, const dds::PublicationMatchedStatus& status) override {
    count(writer, status.last_subscription_handle, status.current_count_change);
  }
  void on_subscription_matched(dds::DataReader* reader,
                               const dds::SubscriptionMatchedStatus& status) override {
    count(reader, status.last_publication_handle, status.current_count_change);
  }

 private:
  void count(const dds::DomainEntity* endpoint, const dds::InstanceHandle_t& partner, std::int32_t change) {
    const std::lock_guard lock(mutex_);
    if (run_.count(fastrtps::iHandle2GUID(partner).guidPrefix) != 0) count_[endpoint] += change;
  }

  const std::string mark_;
  mutable std::mutex mutex_;
  std::set<fastrtps::GuidPrefix_t> run_;
  std::map<const dds::DomainEntity*, std::int32_t> count_;
};

FastDdsParticipant::FastDdsParticipant(const FastDdsOptions& options)
    : domain_(options.domain),
      topic_prefix_(options.topic_prefix),
      partners_(std::make_unique<Partners>(options)) {
  dds::DomainParticipantQos qos = participant_qos(options);
  const std::string mark = run_mark(options);
  qos.user_data().data_vec({mark.begin(), mark.end()});
  participant_ =
      create_participant(options.domain, qos, partners_.get(),
                         dds::StatusMask::publication_matched() << dds::StatusMask::subscription_matched());
  partners_->add_participant(participant_->guid().guidPrefix);
  dds::PublisherQos publisher_qos;
  dds::SubscriberQos subscriber_qos;
  if (!options.partition.empty()) {
    publisher_qos.partition().push_back(options.partition.c_str());
    subscriber_qos.partition().push_back(options.partition.c_str());
  }
  publisher_ = participant_->create_publisher(publisher_qos);
  subscriber_ = participant_->create_subscriber(subscriber_qos);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    throw TransportError("Fast DDS could not create a publisher and a subscriber; see its message above");
  }
}

FastDdsParticipant::~FastDdsParticipant() {
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

void FastDdsParticipant::register_type(const dds::TypeSupport& type) {
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  type_name_ = type.get_type_name();
  type.register_type(participant_);
}

dds::Topic* FastDdsParticipant::topic(const std::string& name) {
  const std::string full = topic_prefix_ + name;
  if (auto* known = dynamic_cast<dds::Topic*>(participant_->lookup_topicdescription(full))) return known;
  dds::Topic* created = participant_->create_topic(full, type_name_, dds::TOPIC_QOS_DEFAULT);
  if (created == nullptr) throw TransportError("Fast DDS could not create the topic " + name);
  return created;
}

dds::DataWriter* FastDdsParticipant::add_writer(const std::string& topic_name, std::uint32_t depth,
                                                std::uint32_t readers) {
  auto qos = reliable<dds::DataWriterQos>(depth);
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  dds::DataWriter* writer = publisher_->create_datawriter(topic(topic_name), qos);
  if (writer == nullptr) throw TransportError("Fast DDS could not create a writer of topic " + topic_name);
  writers_.push_back({writer, topic_name, static_cast<std::int32_t>(readers)});
  return writer;
}

dds::DataReader* FastDdsParticipant::add_reader(const std::string& topic_name, std::uint32_t depth,
                                                std::uint32_t writers, dds::DataReaderListener* listener) {
  dds::DataReader* reader = subscriber_->create_datareader(
      topic(topic_name), reliable<dds::DataReaderQos>(depth), nullptr, dds::StatusMask::none());
  if (reader == nullptr) throw TransportError("Fast DDS could not create a reader of topic " + topic_name);
  // Set only now, so that the listener's pointer to its reader is set before the first call.
  reader->set_listener(listener, dds::StatusMask::data_available());
  readers_.push_back({reader, topic_name, static_cast<std::int32_t>(writers)});
  return reader;
}

bool FastDdsParticipant::is_of_run(const dds::InstanceHandle_t& writer) const {
  const fastrtps::GuidPrefix_t prefix = fastrtps::iHandle2GUID(writer).guidPrefix;
  return prefix == participant_->guid().guidPrefix || partners_->contains(prefix);
}

void FastDdsParticipant::wait_until_matched(Time deadline) const {
  const auto unmatched = [this](const std::vector<Expected>& endpoints, const char* kind) {
    for (const Expected& e : endpoints) {
      const std::int32_t matched = partners_->of(e.endpoint);
      if (matched < e.partners)
        return concat(kind, " of topic ", e.topic, " matched ", matched, " of ", e.partners);
    }
    return std::string();
  };
  for (;;) {
    std::string missing = unmatched(writers_, "writer");
    if (missing.empty()) missing = unmatched(readers_, "reader");
    if (missing.empty()) return;
    if (now() >= deadline)
      throw TransportError(
          concat("discovery did not finish in time: the ", missing, " partners in DDS domain ", domain_));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace hotpath
