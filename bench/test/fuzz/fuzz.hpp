// SPDX-License-Identifier: Apache-2.0
// Common parts of the fuzz targets. A target reads one input like a program reads a user's file. It
// may reject the input with an error that ends the program with exit code 2. Any other exception, a
// failed assertion or a sanitizer report is a finding.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/core/input_file.hpp"
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

  const std::string& path() const { return path_; }

 private:
  int descriptor_ = memfd_create("input", 0);
  std::string path_ = "/proc/self/fd/" + std::to_string(descriptor_);
};

/// A folder in memory, for readers and writers of several files; it disappears with the process.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string path = "/dev/shm/hotpath_fuzz_XXXXXX";
    if (mkdtemp(path.data()) == nullptr) std::abort();
    path_ = path;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Calls the reader and accepts its regular errors. Returns the value that libFuzzer expects.
int read_or_refuse(const auto& read) {
  try {
    read();
  } catch (const InputError&) {
  } catch (const program::UsageError&) {
  } catch (const AnalysisError&) {
  }
  return 0;
}

}  // namespace hotpath::fuzz
