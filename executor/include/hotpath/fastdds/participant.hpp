// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "hotpath/fastdds/options.hpp"

namespace hotpath {

/// The QoS of a participant with these options.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipantQos participant_qos(const FastDdsOptions& options);

/// Creates a participant that logs to standard error, for programs that create their own endpoints.
/// The caller deletes it. Throws TransportError if Fast DDS cannot create it.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipant* create_participant(
    std::uint32_t domain, const eprosima::fastdds::dds::DomainParticipantQos& qos,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr,
    const eprosima::fastdds::dds::StatusMask& events = eprosima::fastdds::dds::StatusMask::none());
/// Creates a participant that joins and leaves during a run and announces itself accordingly.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipant* create_participant(const FastDdsOptions& options);

/// The only participant of a process, with a publisher and a subscriber. Its destructor removes
/// everything created through it; loans must have been returned.
class FastDdsParticipant {
 public:
  /// Throws TransportError if Fast DDS cannot create it.
  explicit FastDdsParticipant(const FastDdsOptions& options);
  ~FastDdsParticipant();
  FastDdsParticipant(const FastDdsParticipant&) = delete;
  FastDdsParticipant& operator=(const FastDdsParticipant&) = delete;

  void register_type(const eprosima::fastdds::dds::TypeSupport& type);

  /// Reliable, KEEP_LAST `depth`, published synchronously. Throws TransportError.
  eprosima::fastdds::dds::DataWriter* add_writer(const std::string& topic, std::uint32_t depth,
                                                 std::uint32_t readers);
  eprosima::fastdds::dds::DataReader* add_reader(const std::string& topic, std::uint32_t depth,
                                                 std::uint32_t writers,
                                                 eprosima::fastdds::dds::DataReaderListener* listener);

  /// Whether a writer, given by its instance handle, belongs to this run: to this participant, or
  /// to another FastDdsParticipant with the same partition and topic prefix.
  [[nodiscard]] bool is_of_run(const eprosima::fastdds::dds::InstanceHandle_t& writer) const;

  /// Waits until every endpoint is matched with its partners in FastDdsParticipants of the same
  /// partition and topic prefix; other endpoints do not count. Throws TransportError with an
  /// unmatched endpoint if `deadline` passes.
  void wait_until_matched(Time deadline) const;

 private:
  struct Expected {
    const eprosima::fastdds::dds::DomainEntity* endpoint;
    std::string topic;
    std::int32_t partners;
  };
  class Partners;
  eprosima::fastdds::dds::Topic* topic(const std::string& name);

  const std::uint32_t domain_;
  const std::string topic_prefix_;
  const std::unique_ptr<Partners> partners_;
  std::string type_name_;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  std::vector<Expected> writers_, readers_;
};

}  // namespace hotpath
