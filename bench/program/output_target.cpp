// SPDX-License-Identifier: Apache-2.0
#include "program/output_target.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "hotpath/core/enum_text.hpp"
#include "program/errors.hpp"

namespace hotpath::program {

namespace fs = std::filesystem;

namespace {

/// The limit of Linux.
constexpr int kMostLinks = 40;

/// The descriptor that a name in /proc/self/fd denotes; otherwise -1.
int descriptor_of(const fs::path& file) {
  std::error_code error;
  const fs::path own = fs::canonical("/proc/self/fd", error);
  if (error || fs::canonical(folder_of(file), error) != own || error) return -1;
  return parse<int>(file.filename().string()).value_or(-1);
}

/// Why the effective user lacks the access `mode`; empty: permitted.
std::error_code permitted(const fs::path& path, int mode) {
  if (faccessat(AT_FDCWD, path.c_str(), mode, AT_EACCESS) == 0) return {};
  return {errno, std::generic_category()};
}

/// Why no name can be created in the folder; empty: possible.
std::error_code can_create_in(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found)
    return std::make_error_code(std::errc::no_such_file_or_directory);
  if (error) return error;
  if (!fs::is_directory(status)) return std::make_error_code(std::errc::not_a_directory);
  return permitted(folder, W_OK | X_OK);
}

/// The same for a new folder; its nearest existing parent decides.
std::error_code can_create_folder(const fs::path& folder) {
  const fs::path above = folder_of(folder);
  std::error_code error;
  const bool missing = fs::symlink_status(above, error).type() == fs::file_type::not_found;
  return missing && above != folder ? can_create_folder(above) : can_create_in(above);
}

}  // namespace

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

OutputTarget find_target(const fs::path& file) {
  OutputTarget target{file, false, -1, {}};
  std::error_code& error = target.error;
  for (int links = 0;; ++links) {
    target.descriptor = descriptor_of(target.name);
    if (target.descriptor >= 0 || !fs::is_symlink(fs::symlink_status(target.name, error))) break;
    fs::path to = fs::read_symlink(target.name, error);
    if (links == kMostLinks) error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
    if (error) return target;
    target.name = folder_of(target.name) / to;
  }
  const fs::file_status status = fs::status(target.name, error);
  error.clear();
  if (fs::is_directory(status) || !target.name.has_filename()) {
    error = std::make_error_code(std::errc::is_a_directory);
  } else if (!fs::exists(status)) {
    error = can_create_in(folder_of(target.name));
  } else {
    target.in_place = target.descriptor >= 0 || !fs::is_regular_file(status);
    if (target.descriptor < 0) error = permitted(target.name, W_OK);
    if (!error && !target.in_place) error = can_create_in(folder_of(target.name));
  }
  return target;
}

void require(const std::error_code& error, const std::string& option, const std::string& what,
             const char* remedy) {
  if (error) throw UsageError(option + ": " + what + " (" + error.message() + "); name another" + remedy);
}

void check_output_file(const fs::path& file, const std::string& option) {
  require(find_target(file).error, option, file.string() + " cannot be written", " place");
}

void check_output_folder(const fs::path& folder, const std::string& mark, const std::string& option) {
  std::error_code error;
  const fs::path path = folder.has_filename() ? folder : folder.parent_path();  // without a slash at its end
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    const bool dangles = fs::is_symlink(fs::symlink_status(path, error));
    error = dangles ? std::make_error_code(std::errc::file_exists) : can_create_folder(path);
  } else if (!error && !fs::is_directory(status)) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  const std::string named = "the folder " + folder.string();
  require(error, option, named + " cannot be created");
  if (!fs::exists(status)) return;
  const bool empty = fs::is_empty(path, error);
  if (!error && !empty && (mark.empty() || !fs::exists(path / mark, error))) {
    throw UsageError(option + ": " + named + " holds " + (mark.empty() ? "files" : "other files") +
                     " already; name a new folder, or empty it");
  }
  if (!error) error = permitted(path, W_OK | X_OK);
  require(error, option, named + " cannot be written");
}

}  // namespace hotpath::program
