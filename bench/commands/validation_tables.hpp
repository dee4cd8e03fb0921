// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>

#include "validation/validation_json.hpp"

namespace hotpath {

/// What `hotpath validate` prints: a table for each kind of comparison, and the verdicts.
void write_validation(std::ostream& out, const Validation& validation);

}  // namespace hotpath
