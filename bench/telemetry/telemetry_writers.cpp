// SPDX-License-Identifier: Apache-2.0
#include "telemetry/telemetry_writers.hpp"

#include <TelemetryPubSubTypes.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <thread>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath::telemetry {

namespace dds = eprosima::fastdds::dds;

namespace {

constexpr std::int32_t kSamplesKept = 1024, kStatisticsKept = 16;

dds::DataWriterQos writer_qos(std::int32_t depth) {
  dds::DataWriterQos qos;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  // Fast DDS sends large samples in fragments, from its own thread.
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  // Determines when readers acknowledge and when lost packets are resent; 3 s by default.
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, 100'000'000};
  return qos;
}

template <class PubSubType>
dds::DataWriter* add_writer(dds::Publisher& publisher, const std::string& topic_name, std::int32_t depth) {
  auto* participant = const_cast<dds::DomainParticipant*>(publisher.get_participant());
  dds::TypeSupport type(new PubSubType);
  type->auto_fill_type_information(false);
  type->auto_fill_type_object(false);
  type.register_type(participant);
  dds::Topic* topic = participant->create_topic(topic_name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  dds::DataWriter* writer =
      topic == nullptr ? nullptr : publisher.create_datawriter(topic, writer_qos(depth));
  if (writer == nullptr) throw TransportError("Fast DDS could not create a writer of topic " + topic_name);
  return writer;
}

}  // namespace

Writers::Writers(const FastDdsOptions& options) : participant_(create_participant(options)) {
  dds::Publisher* publisher = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  if (publisher == nullptr) throw TransportError("Fast DDS could not create a publisher");
  run_ = add_writer<telemetry::RunInfoPubSubType>(*publisher, telemetry::RUN_TOPIC, 1);
  statistics_ =
      add_writer<telemetry::StatisticsPubSubType>(*publisher, telemetry::STATISTICS_TOPIC, kStatisticsKept);
  chain_samples_ =
      add_writer<telemetry::ChainSamplePubSubType>(*publisher, telemetry::CHAIN_SAMPLES_TOPIC, kSamplesKept);
  clock_ = add_writer<telemetry::ClockPubSubType>(*publisher, telemetry::CLOCK_TOPIC, 1);
}

Writers::~Writers() {
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

void Writers::publish(telemetry::RunInfo info) { run_->write(&info); }

void Writers::publish(telemetry::ChainSample sample) {
  if (samples_written_ - samples_acknowledged_ >= kSamplesKept) note_acknowledged();
  samples_lost_ += samples_written_ - samples_acknowledged_ >= kSamplesKept;
  chain_samples_->write(&sample);
  ++samples_written_;
}

void Writers::publish(telemetry::Statistics statistics) {
  note_acknowledged();
  statistics.samples_lost(samples_lost_);
  statistics_->write(&statistics);
}

void Writers::publish(telemetry::Clock clock) { clock_->write(&clock); }

void Writers::note_acknowledged() {
  if (samples_acknowledged_ == samples_written_) return;
  const auto all = chain_samples_->wait_for_acknowledgments({0, 0});
  if (all == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) samples_acknowledged_ = samples_written_;
}

void Writers::await_reader(Duration limit) const {
  const Time until = now() + limit;
  dds::PublicationMatchedStatus status;
  do {
    chain_samples_->get_publication_matched_status(status);
    if (status.current_count > 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  } while (now() < until);
}

void Writers::flush(Duration limit) const {
  const Time until = now() + limit;
  for (dds::DataWriter* writer : {run_, chain_samples_, statistics_}) {
    writer->wait_for_acknowledgments(
        eprosima::fastrtps::Duration_t(to_s(std::max(until - now(), Duration::zero()))));
  }
}

}  // namespace hotpath::telemetry
