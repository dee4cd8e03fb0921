// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace hotpath {

/// What a user can correct in a file: `FILE:LINE: what is wrong; what would be right`.
struct InputError : std::runtime_error {
  /// `line` counts from 1; 0 means the file as a whole and is left out.
  InputError(const std::string& file, std::int64_t line, const std::string& problem,
             const std::string& remedy)
      : std::runtime_error(file + (line > 0 ? ":" + std::to_string(line) : "") + ": " + problem + "; " +
                           remedy) {}
};

}  // namespace hotpath
