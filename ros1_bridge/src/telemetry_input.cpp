// SPDX-License-Identifier: Apache-2.0
#include "telemetry_input.hpp"

#include <Message4kbPubSubTypes.h>
#include <TelemetryPubSubTypes.h>

#include <algorithm>
#include <deque>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

#include "hotpath/fastdds/guarded_type.hpp"
#include "hotpath/fastdds/participant.hpp"
#include "text.hpp"

namespace hotpath {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

namespace {

dds::DomainParticipantQos bridge_qos(const TelemetryOptions& options) {
  FastDdsOptions network;
  network.loopback_only = !options.all_interfaces;
  dds::DomainParticipantQos qos = participant_qos(network);
  qos.name("hotpath_ros1_bridge");
  // Later benchmarks discover this participant by its announcements, by default only every 3 s.
  qos.wire_protocol().builtin.discovery_config.leaseDuration_announcementperiod = {0, 200'000'000};
  return qos;
}

dds::DataReaderQos reader_qos(std::int32_t depth, bool reliable, bool transient_local) {
  dds::DataReaderQos qos;
  qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      transient_local ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.data_sharing().off();
  // Sequences and texts are unbounded.
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  return qos;
}

template <class Entity>
Entity* created(Entity* entity, const std::string& what) {
  if (entity == nullptr) {
    throw std::runtime_error("Fast DDS could not create " + what + "; its own message is above");
  }
  return entity;
}

}  // namespace

struct TelemetryInput::Dds final : dds::DomainParticipantListener {
  /// Passes on the samples of one topic one by one.
  struct Reader final : dds::DataReaderListener {
    std::function<void(dds::DataReader&)> take_all;
    std::atomic<std::int32_t> writers{0};

    void on_data_available(dds::DataReader* reader) override { take_all(*reader); }
    void on_subscription_matched(dds::DataReader*, const dds::SubscriptionMatchedStatus& status) override {
      writers = status.current_count;
    }
  };
  using Readers = std::deque<Reader>;

  Dds(TelemetryInput& input, const TelemetryOptions& options) : owner(input) {
    participant = create_participant(options.domain, bridge_qos(options), this);
    subscriber = created(participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT), "a subscriber");
  }

  ~Dds() override {
    participant->set_listener(nullptr, dds::StatusMask::none());
    participant->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
  }

  /// `enqueue` gets each sample, which it may move from, and its publication instant.
  template <class PubSubType, class Enqueue>
  void read(Readers& into, dds::Subscriber& from, const std::string& topic, const dds::DataReaderQos& qos,
            Enqueue enqueue) {
    dds::TypeSupport type(new GuardedType<PubSubType>);
    type->auto_fill_type_information(false);
    type->auto_fill_type_object(false);
    type.register_type(participant);
    {
      const std::lock_guard lock(mutex);
      const std::string& known = types.try_emplace(topic, type.get_type_name()).first->second;
      if (known != type.get_type_name()) {
        owner.complain("the bridge already reads the DDS topic " + printable(topic, kMostOfName) + " as " +
                       known + ", not as " + type.get_type_name());
        return;
      }
    }
    auto* description = dynamic_cast<dds::Topic*>(participant->lookup_topicdescription(topic));
    if (description == nullptr) {
      description = created(participant->create_topic(topic, type.get_type_name(), dds::TOPIC_QOS_DEFAULT),
                            "the topic " + printable(topic, kMostOfName));
    }
    Reader& reader = into.emplace_back();
    reader.take_all = [enqueue](dds::DataReader& endpoint) {
      typename PubSubType::type sample;
      dds::SampleInfo info;
      while (endpoint.take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
        if (info.valid_data) enqueue(sample, info.source_timestamp.to_ns());
      }
    };
    created(
        from.create_datareader(description, qos, &reader,
                               dds::StatusMask::data_available() << dds::StatusMask::subscription_matched()),
        "a reader of topic " + printable(topic, kMostOfName));
  }

  void forget_points() {
    if (points_subscriber == nullptr) return;
    points_subscriber->delete_contained_entities();
    participant->delete_subscriber(points_subscriber);
    points_subscriber = nullptr;
    points_readers.clear();
    for (const std::string& topic : points_topics) {
      auto* description = dynamic_cast<dds::Topic*>(participant->lookup_topicdescription(topic));
      // Fails for a topic that has other readers.
      if (description == nullptr || participant->delete_topic(description) != ReturnCode_t::RETCODE_OK)
        continue;
      const std::lock_guard lock(mutex);
      types.erase(topic);
    }
  }

  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& found) override {
    const std::string topic = found.info.topicName().to_string(), type = found.info.typeName().to_string();
    std::string own;
    {
      const std::lock_guard lock(mutex);
      const auto known = types.find(topic);
      if (known == types.end() || known->second == type) return;
      own = known->second;
    }
    owner.complain(
        "another program publishes the DDS topic " + printable(topic, kMostOfName) + " as " +
        printable(type, kMostOfName) + ", but the bridge reads it as " + own +
        ": build benchmark and bridge from one version, or give them their own DDS domain (--domain)");
  }

  TelemetryInput& owner;
  std::mutex mutex;
  std::map<std::string, std::string> types;  // by topic
  // The participant calls these readers; the destructor deletes it first. The last of `readers` is
  // that of the runs.
  Readers readers, points_readers;
  std::vector<std::string> points_topics;
  dds::DomainParticipant* participant = nullptr;
  dds::Subscriber* subscriber = nullptr;
  dds::Subscriber* points_subscriber = nullptr;
};

TelemetryInput::TelemetryInput(const TelemetryOptions& options) {
  dds_ = std::make_unique<Dds>(*this, options);
  const auto read = [&]<class PubSubType>(const std::string& topic, std::int32_t depth, bool transient_local,
                                          PubSubType*) {
    dds_->read<PubSubType>(dds_->readers, *dds_->subscriber, topic, reader_qos(depth, true, transient_local),
                           [this](auto& sample, std::int64_t) { enqueue(std::move(sample)); });
  };
  read(telemetry::STATISTICS_TOPIC, 16, false, static_cast<telemetry::StatisticsPubSubType*>(nullptr));
  read(telemetry::CHAIN_SAMPLES_TOPIC, 1024, false, static_cast<telemetry::ChainSamplePubSubType*>(nullptr));
  read(telemetry::CLOCK_TOPIC, 16, false, static_cast<telemetry::ClockPubSubType*>(nullptr));
  read(telemetry::RUN_TOPIC, 1, true, static_cast<telemetry::RunInfoPubSubType*>(nullptr));
  dds_->participant->set_listener(dds_.get(), dds::StatusMask::none());
}

TelemetryInput::~TelemetryInput() = default;

std::int32_t TelemetryInput::benchmarks() const { return dds_->readers.back().writers; }

void TelemetryInput::read_points(const std::vector<std::string>& topics) {
  dds_->forget_points();
  if (topics.empty()) return;
  dds::SubscriberQos qos;
  qos.partition().push_back("*");
  dds_->points_topics = topics;
  dds_->points_subscriber = created(dds_->participant->create_subscriber(qos), "a subscriber");
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    dds_->read<msg::Message4kbPubSubType>(
        dds_->points_readers, *dds_->points_subscriber, topics[i], reader_qos(16, false, false),
        [this, i](const msg::Message4kb& sample, std::int64_t published_ns) {
          const std::uint64_t own = sample.size() == 0 ? 0 : std::min<std::uint64_t>(sample.size(), 63) - 1;
          enqueue(LidarSample{i, published_ns, sample.stats()[own].sequence_number()});
        });
  }
}

TelemetryInput::Counts TelemetryInput::counts(std::size_t stream) const {
  return {counters_[stream].received.load(), counters_[stream].dropped.load()};
}

std::vector<std::string> TelemetryInput::take_complaints() {
  const std::lock_guard lock(mutex_);
  return std::exchange(new_complaints_, {});
}

void TelemetryInput::enqueue(Event event) {
  Counters& counters = counters_[event.index()];
  counters.received.fetch_add(1, std::memory_order_relaxed);
  const std::size_t bytes = bytes_of(event);
  const bool rare = std::holds_alternative<telemetry::RunInfo>(event);
  if (!queue_.push(std::move(event), bytes, rare)) counters.dropped.fetch_add(1, std::memory_order_relaxed);
}

void TelemetryInput::complain(const std::string& text) {
  constexpr std::size_t kMost = 100;
  const std::lock_guard lock(mutex_);
  if (known_complaints_.size() >= kMost || !known_complaints_.insert(text).second) return;
  new_complaints_.push_back(text);
}

}  // namespace hotpath
