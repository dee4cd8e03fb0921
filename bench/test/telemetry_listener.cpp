// SPDX-License-Identifier: Apache-2.0
// telemetry_listener --domain N [--seconds S]
//
// Prints `{"kind": "ready"}`, then one line of JSON for each sample of a live run or a replay of one
// repetition. Ends after its last statistics, or after `--seconds`.
#include <TelemetryPubSubTypes.h>

#include <CLI/CLI.hpp>
#include <fastdds/dds/core/condition/StatusCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "hotpath/fastdds/participant.hpp"

namespace hotpath {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;
using nlohmann::json;

namespace {

struct Arguments {
  FastDdsOptions dds;
  double seconds = 60;
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
      : arguments_(arguments), participant_(create_participant(arguments.dds)) {
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
    run_ = add<telemetry::RunInfoPubSubType>(telemetry::RUN_TOPIC);
    samples_ = add<telemetry::ChainSamplePubSubType>(telemetry::CHAIN_SAMPLES_TOPIC);
    statistics_ = add<telemetry::StatisticsPubSubType>(telemetry::STATISTICS_TOPIC);
    clock_ = add<telemetry::ClockPubSubType>(telemetry::CLOCK_TOPIC);
  }
  ~Listener() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  void run() {
    print({{"kind", "ready"}});
    const auto limit = std::chrono::steady_clock::now() + from_ms(arguments_.seconds * 1000);
    // The last statistics may overtake samples on other topics; these arrive before their writer
    // leaves.
    dds::ConditionSeq active;
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
  dds::DataReader* add(const std::string& topic_name) {
    dds::TypeSupport type(new PubSubType);
    type.register_type(participant_);
    dds::DataReaderQos qos;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = dds::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 4096;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
    dds::Topic* topic = participant_->create_topic(topic_name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    dds::DataReader* reader = subscriber_->create_datareader(topic, qos);
    dds::StatusCondition& changed = reader->get_statuscondition();
    changed.set_enabled_statuses(dds::StatusMask::data_available()
                                 << dds::StatusMask::subscription_matched());
    something_.attach_condition(changed);
    return reader;
  }

  /// Reading a status resets its condition.
  static void forget_changed_writers(dds::DataReader* reader) {
    dds::SubscriptionMatchedStatus status;
    reader->get_subscription_matched_status(status);
  }

  bool publisher_is_there() const {
    dds::SubscriptionMatchedStatus status;
    samples_->get_subscription_matched_status(status);
    return status.current_count > 0;
  }

  template <class Message, class Visit>
  static void take(dds::DataReader* reader, Visit visit) {
    Message message;
    dds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) visit(message);
    }
  }

  void take_all() {
    for (dds::DataReader* reader : {run_, samples_, statistics_, clock_}) forget_changed_writers(reader);
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
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::DataReader *run_ = nullptr, *samples_ = nullptr, *statistics_ = nullptr, *clock_ = nullptr;
  dds::WaitSet something_;  ///< Wakes for data at a reader, or when a writer matches or leaves.
  bool ended_ = false;
};

}  // namespace
}  // namespace hotpath

int main(int argc, char** argv) {
  hotpath::Arguments arguments;
  CLI::App app("Prints what a live run or a replay publishes");
  app.add_option("--domain", arguments.dds.domain);
  app.add_option("--seconds", arguments.seconds);
  CLI11_PARSE(app, argc, argv);
  hotpath::Listener(arguments).run();
}
