// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hotpath::gbench {

/// Events queues of up to `most` jobs, with standard containers as yardsticks. `min_time`: seconds of each.
void register_queues(std::int64_t most, double min_time);

}  // namespace hotpath::gbench
