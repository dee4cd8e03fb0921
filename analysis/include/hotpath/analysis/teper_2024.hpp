// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/executor_callback.hpp"

namespace hotpath {

/// Bound of one chain element under default executors, in ns (Teper, Betz, Guenzel, Ebner, von der
/// Brueggen, Betz, Chen: "End-to-end timing analysis and optimization of multi-executor ROS 2
/// systems", RTAS 2024).
struct ElementBound {
  /// Lemmas VI.2 (timer), VI.3 (timer of period 0), VI.4 and VI.5 (subscriptions).
  std::int64_t until_start = 0;
  std::int64_t until_finish = 0;  ///< Lemma VI.1, Equation (15).
  std::int64_t total() const;
};

/// The bounds of the elements of `chain` (positions in `callbacks`, from source to sink).
std::vector<ElementBound> teper_2024_elements(const ExecutorCallbacks& callbacks, const TaskChain& chain);

/// End-to-end latency of `chain`: the sum over its elements.
std::int64_t teper_2024(const ExecutorCallbacks& callbacks, const TaskChain& chain);

/// The bounds of the paper's comparison, for timers only, one executor and no DDS cost: L_i = W +
/// max(0, T_i - C_i + H_i) + C_i (Equations 15 and 17) of every task. The end-to-end latency is the
/// sum over the chain.
std::vector<std::int64_t> teper_2024_timers(const PeriodicTasks& tasks);

/// Response time of every callback that runs, from its timestamp (timers) or arrival
/// (subscriptions). Subscriptions: Lemmas VI.4 and VI.1. Timers: W + max(H_i, c_i). A timestamp
/// that leads to a job falls either into a processing window without tau_i (at most W - c_i remain
/// of it; then H_i and c_i follow) or after the start of its job in the window (c_i and all lower
/// priorities remain; then H_i and c_i follow).
std::vector<std::int64_t> teper_2024_response_times(const ExecutorCallbacks& callbacks);

}  // namespace hotpath
