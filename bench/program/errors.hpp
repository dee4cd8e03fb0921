// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hotpath {

/// Wrong use, which the user can mend: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Something failed that is not the command line's fault: exit code 1.
struct RunError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace hotpath
