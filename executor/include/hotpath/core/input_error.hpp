// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace hotpath {

/// A problem of an input file that the user can correct: `FILE:LINE: problem; remedy`.
struct InputError : std::runtime_error {
  /// `line` counts from 1; 0 means the whole file, and the message then has no line number.
  InputError(const std::string& file, std::int64_t line, const std::string& problem,
             const std::string& remedy)
      : std::runtime_error(file + (line > 0 ? ":" + std::to_string(line) : "") + ": " + problem + "; " +
                           remedy) {}
};

}  // namespace hotpath
