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

/// What a participant on these transports is like.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipantQos participant_qos(const FastDdsOptions& options);

/// A participant whose log goes to standard error, for programs that bring their own endpoints. The caller
/// deletes it. Throws TransportError when Fast DDS cannot create it.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipant* create_participant(
    std::uint32_t domain, const eprosima::fastdds::dds::DomainParticipantQos& qos,
    eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr,
    const eprosima::fastdds::dds::StatusMask& events = eprosima::fastdds::dds::StatusMask::none());
/// The same for one that comes and goes during a run, and announces itself accordingly.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipant* create_participant(const FastDdsOptions& options);

/// The one participant of a process, with a publisher and a subscriber. Its destruction removes all that was
/// created through it; loans must have been returned.
class FastDdsParticipant {
 public:
  /// Throws TransportError when Fast DDS cannot create it.
  explicit FastDdsParticipant(const FastDdsOptions& options);
  ~FastDdsParticipant();
  FastDdsParticipant(const FastDdsParticipant&) = delete;
  FastDdsParticipant& operator=(const FastDdsParticipant&) = delete;

  void register_type(eprosima::fastdds::dds::TypeSupport type);

  /// Reliable, KEEP_LAST `depth`, published synchronously. Throws TransportError.
  eprosima::fastdds::dds::DataWriter* add_writer(const std::string& topic, std::uint32_t depth,
                                                 std::uint32_t readers);
  eprosima::fastdds::dds::DataReader* add_reader(const std::string& topic, std::uint32_t depth,
                                                 std::uint32_t writers,
                                                 eprosima::fastdds::dds::DataReaderListener* listener);

  /// Whether a writer, as samples name it, belongs to this run: to this participant, or to one of this class
  /// with the same partition and topic prefix.
  [[nodiscard]] bool is_of_run(const eprosima::fastdds::dds::InstanceHandle_t& writer) const;

  /// Waits until every endpoint has met its partners in the participants of this class with the same
  /// partition and topic prefix; others that listen or publish there do not count. Throws TransportError that
  /// names one that has not by `deadline`.
  void wait_until_matched(Time deadline) const;

 private:
  template <class Endpoint>
  struct Expected {
    Endpoint* endpoint;
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
  std::vector<Expected<eprosima::fastdds::dds::DataWriter>> writers_;
  std::vector<Expected<eprosima::fastdds::dds::DataReader>> readers_;
};

}  // namespace hotpath
