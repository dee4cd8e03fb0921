// SPDX-License-Identifier: Apache-2.0
// What the fuzz targets share. A target reads one input as a program of ours reads a user's file. It may
// refuse it with an error that ends the program with exit code 2; any other exception, a failed assertion,
// and what a sanitizer reports is a finding.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/input_error.hpp"
#include "program/errors.hpp"

namespace hotpath::fuzz {

/// A file in memory, for readers that take a path.
class InputFile {
 public:
  const std::string& hold(const std::uint8_t* data, std::size_t size) {
    const auto bytes = static_cast<ssize_t>(size);
    if (ftruncate(descriptor_, bytes) != 0 || pwrite(descriptor_, data, size, 0) != bytes) std::abort();
    return path_;
  }

 private:
  int descriptor_ = memfd_create("input", 0);
  std::string path_ = "/proc/self/fd/" + std::to_string(descriptor_);
};

/// Reads, or refuses in the way that is right. What libFuzzer wants to be returned.
int read_or_refuse(const auto& read) {
  try {
    read();
  } catch (const InputError&) {
  } catch (const UsageError&) {
  } catch (const AnalysisError&) {
  }
  return 0;
}

}  // namespace hotpath::fuzz
