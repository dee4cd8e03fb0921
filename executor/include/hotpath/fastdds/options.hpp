// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

struct FastDdsOptions {
  /// How samples get to other processes. Within the process they are always handed over directly.
  enum class Network : std::uint8_t {
    udp,            ///< UDP over IPv4.
    shared_memory,  ///< Fast DDS's shared memory transport; UDP for discovery.
  };
  std::uint32_t domain = 0;  ///< DDS domain, 0 to 232.
  std::string partition;     ///< Keeps runs on one domain apart; empty: DDS's default partition.
  std::string key;  ///< A partition of the run's processes alone, so that readers meet no other writers; may
                    ///< be empty. Others may read what is published in `partition`.
  Network network = Network::udp;
  bool loopback_only = true;  ///< Nothing leaves the machine.
};
constexpr auto enum_texts(FastDdsOptions::Network) {
  return std::to_array<EnumText<FastDdsOptions::Network>>(
      {{FastDdsOptions::Network::udp, "udp"}, {FastDdsOptions::Network::shared_memory, "shared_memory"}});
}

}  // namespace hotpath
