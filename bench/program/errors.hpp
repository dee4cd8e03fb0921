// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hotpath::program {

/// Wrong use, which the user can correct: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A simulated system is overloaded, which a search may expect as a result.
struct OverloadError : UsageError {
  using UsageError::UsageError;
};

/// A failure that the command line did not cause: exit code 1.
struct RunError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A watched contract is broken: exit code 3.
struct ContractBroken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hotpath::program
