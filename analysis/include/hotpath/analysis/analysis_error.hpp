// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hotpath {

/// A method cannot handle the input. The message names the problem, the task or chain, the method,
/// and a method that accepts the input.
struct AnalysisError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hotpath
