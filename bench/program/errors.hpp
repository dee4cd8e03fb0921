// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hotpath {

/// Wrong use, which the user can mend: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// More work than a simulated system can do, which may be the answer that was sought.
struct OverloadError : UsageError {
  using UsageError::UsageError;
};

/// Something failed that is not the command line's fault: exit code 1.
struct RunError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hotpath
