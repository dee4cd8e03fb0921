// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/common/SerializedPayload.h>
#include <exception>

namespace hotpath {

/// Type support that rejects malformed messages. The generated code throws an exception instead
/// (for an unknown encapsulation, for example), which would terminate the program in a thread of
/// Fast DDS: a single packet from anyone in the domain would suffice.
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
