// SPDX-License-Identifier: Apache-2.0
#include <Message4kbPubSubTypes.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <thread>

#include "hotpath/fastdds/participant.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath::partners_test {

namespace dds = eprosima::fastdds::dds;
using ::testing::HasSubstr;

FastDdsOptions options() {
  FastDdsOptions o;
  o.domain = 100 + static_cast<std::uint32_t>(getpid() % 100);
  o.partition = "partners";
  o.topic_prefix = "of this run/";
  return o;
}

Time in(Duration d) { return now() + d; }

dds::TypeSupport message_type() { return dds::TypeSupport(new msg::Message4kbPubSubType); }

/// Reads a topic of the run without being part of it, like a bridge.
class Outsider {
 public:
  explicit Outsider(const std::string& topic) : participant_(create_participant(options())) {
    dds::TypeSupport type = message_type();
    type.register_type(participant_);
    dds::SubscriberQos qos;
    qos.partition().push_back("*");
    reader_ = participant_->create_subscriber(qos)->create_datareader(
        participant_->create_topic(options().topic_prefix + topic, type.get_type_name(),
                                   dds::TOPIC_QOS_DEFAULT),
        dds::DATAREADER_QOS_DEFAULT);
  }
  ~Outsider() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Outsider(const Outsider&) = delete;
  Outsider& operator=(const Outsider&) = delete;

  bool await_writer(Time limit) const {
    dds::SubscriptionMatchedStatus status;
    for (; status.current_count == 0 && now() < limit; std::this_thread::yield())
      reader_->get_subscription_matched_status(status);
    return status.current_count > 0;
  }

 private:
  dds::DomainParticipant* participant_;
  dds::DataReader* reader_ = nullptr;
};

TEST(Partners, AnOutsideReaderIsNotOneOfTheRunsOwn) {
  FastDdsParticipant publisher(options());
  publisher.register_type(message_type());
  publisher.add_writer("Lidar", 1, 1);
  const Outsider outsider("Lidar");
  ASSERT_TRUE(outsider.await_writer(in(std::chrono::seconds(30))));
  EXPECT_THAT([&] { publisher.wait_until_matched(in(Duration::zero())); },
              testing::ThrowsMessage<TransportError>(HasSubstr("writer of topic Lidar matched 0 of 1")))
      << "took the outside reader for its own";

  FastDdsParticipant subscriber(options());
  subscriber.register_type(message_type());
  subscriber.add_reader("Lidar", 1, 1, nullptr);
  publisher.wait_until_matched(in(std::chrono::seconds(30)));
  subscriber.wait_until_matched(in(std::chrono::seconds(30)));
}

}  // namespace hotpath::partners_test
