// SPDX-License-Identifier: Apache-2.0
// The files of the Python package (hotpath_report/tables.py), which calls these functions with ctypes,
// so that all files are written by the same rules. Each returns the message of a failure, which is valid
// until the next call on this thread, or null.
#include <exception>

#include "program/errors.hpp"
#include "program/whole_file.hpp"

namespace {

template <class Write>
const char* message_of(Write write) {
  thread_local std::string message;
  try {
    write();
    return nullptr;
  } catch (const std::exception& error) {
    message = error.what();
    return message.c_str();
  }
}

}  // namespace

extern "C" {

/// Replaces a file; see write_whole_file().
const char* hotpath_write_file(const char* path, const char* content, std::size_t size) {
  return message_of([&] { hotpath::program::write_whole_file(path, std::string(content, size)); });
}

/// Writes the file that `option` names; see write_output_file().
const char* hotpath_write_output(const char* path, const char* option, const char* content,
                                 std::size_t size) {
  return message_of([&] { hotpath::program::write_output_file(path, option, std::string(content, size)); });
}

/// Creates a folder and its parents durably.
const char* hotpath_make_folder(const char* path) {
  return message_of([&] { hotpath::program::create_folder(path); });
}

/// Renames `part` to `path` durably.
const char* hotpath_name_durably(const char* part, const char* path) {
  return message_of([&] {
    if (const std::error_code error = hotpath::program::name_durably(part, path)) {
      throw hotpath::program::RunError(std::string(path) + " cannot be written (" + error.message() + ")");
    }
  });
}

}  // extern "C"
