// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/common/SerializedPayload.h>
#include <exception>

namespace hotpath {

/// Generated type support that refuses what is none of its messages. By itself it lets an exception pass (an
/// unknown encapsulation, for example), which ends the program in a thread of Fast DDS: one packet of anybody
/// in the domain would do.
template <class PubSubType>
struct GuardedType : PubSubType {
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      return PubSubType::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

}  // namespace hotpath
