// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

/// Parameters of the Fast DDS transport.
struct FastDdsOptions {
  /// Transport of samples to other processes. Within the process they are always handed over
  /// directly.
  enum class Network : std::uint8_t {
    udp,            ///< UDP over IPv4.
    shared_memory,  ///< Fast DDS's shared memory transport; UDP for discovery.
  };
  std::uint32_t domain = 0;  ///< DDS domain, 0 to 232.
  std::string partition;     ///< Partition of the run's processes only; empty: DDS's default partition.
  /// Prefix of the run's DDS topic names, used by no other topic. With an unguessable prefix,
  /// endpoints of other programs match none of the run's, in any partition.
  std::string topic_prefix;
  Network network = Network::udp;
  bool loopback_only = true;  ///< Restricts traffic to the loopback interface.
};
constexpr auto enum_texts(FastDdsOptions::Network) {
  return texts_in_order<FastDdsOptions::Network>({"udp", "shared_memory"});
}

}  // namespace hotpath
