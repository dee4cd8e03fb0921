// SPDX-License-Identifier: Apache-2.0
// Publishes malformed runs until SIGINT: first a run that the bridge must reject, then a run that
// it can show, with names that are long, are not UTF-8 and would clear a terminal's screen. Also
// publishes a topic with a type that the bridge does not expect.
#include <TelemetryPubSubTypes.h>

#include <csignal>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <limits>
#include <string>

#include "hotpath/fastdds/participant.hpp"

namespace {

using namespace hotpath;
namespace fast = eprosima::fastdds::dds;

template <class PubSubType>
class Writer {
 public:
  Writer(fast::DomainParticipant& participant, const std::string& topic) {
    fast::TypeSupport type(new PubSubType);
    type.register_type(&participant);
    fast::DataWriterQos qos;
    qos.durability().kind = fast::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_ALL_HISTORY_QOS;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    fast::Topic* description = participant.create_topic(topic, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    writer_ = participant.create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(description, qos);
  }

  void write(typename PubSubType::type sample) { writer_->write(&sample); }

  bool has_reader() const {
    fast::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count > 0;
  }

 private:
  fast::DataWriter* writer_;
};

telemetry::RunInfo strange_run(const std::string& id) {
  const std::string hostile = "\x1b[2J\n\xff" + std::string(100'000, 'x');
  telemetry::RunInfo run;
  run.run_id(id);
  for (std::string* text : {&run.graph(), &run.executor(), &run.transport(), &run.origin()}) *text = hostile;
  run.nodes().resize(2);
  for (telemetry::NodeInfo& node : run.nodes()) node.name(hostile);
  run.chains().resize(2);
  for (telemetry::ChainInfo& chain : run.chains()) chain.name(hostile);
  run.facts(std::string(100'000, '['));
  return run;
}

}  // namespace

/// strange_run DOMAIN
int main(int, char** argv) {
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGINT);
  pthread_sigmask(SIG_BLOCK, &end, nullptr);  // inherited by all later threads
  FastDdsOptions options;
  options.loopback_only = true;
  fast::DomainParticipant* participant =
      create_participant(static_cast<std::uint32_t>(std::atoi(argv[1])), participant_qos(options), nullptr);
  {
    Writer<telemetry::RunInfoPubSubType> runs(*participant, telemetry::RUN_TOPIC);
    Writer<telemetry::StatisticsPubSubType> statistics(*participant, telemetry::STATISTICS_TOPIC);
    const Writer<telemetry::ChainSamplePubSubType> other_type(*participant, telemetry::CLOCK_TOPIC);
    telemetry::RunInfo refused = strange_run("refused");
    refused.nodes()[0].layout_x(std::numeric_limits<double>::quiet_NaN());
    const telemetry::RunInfo shown = strange_run("shown");
    telemetry::Statistics now;
    now.run_id(shown.run_id());
    now.nodes().resize(2);
    now.chains().resize(2);
    now.run_time_s(1e308);
    now.nodes()[0].utilization(1e308);
    const timespec pace{0, 100'000'000};
    // Repeated, since a reader keeps only the last sample and may miss some.
    for (int refusals = 0; sigtimedwait(&end, nullptr, &pace) != SIGINT;) {
      if (!runs.has_reader()) continue;
      runs.write(++refusals <= 10 ? refused : shown);
      statistics.write(now);
      now.number(now.number() + 1);
    }
  }
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
