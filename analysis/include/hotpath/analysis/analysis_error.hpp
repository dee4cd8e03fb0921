// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hotpath {

/// Input that a method cannot answer for. The message says what is wrong, in which task or chain, which
/// method refuses, and which one would accept.
struct AnalysisError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hotpath
