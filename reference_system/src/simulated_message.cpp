// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/simulated_message.hpp"

namespace hotpath {

void SimulatedMessagePool::give_back(SimulatedMessage& message) { free_.push_back(&message); }

}  // namespace hotpath
