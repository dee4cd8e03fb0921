// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::gbench {

/// Dispatch latency, wake-up latency, throughput and CPU time of whole live executors.
void register_live_benchmarks(bool quick);

}  // namespace hotpath::gbench
