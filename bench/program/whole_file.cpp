// SPDX-License-Identifier: Apache-2.0
#include "program/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>

#include "program/errors.hpp"

namespace hotpath {

namespace fs = std::filesystem;

namespace {

/// Returns why it failed; empty: it did not.
std::string write_and_rename(const fs::path& file, const FileContent& content) {
  const fs::path part = file.string() + ".part";
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  if (const auto* text = std::get_if<std::string>(&content)) {
    out << *text;
  } else if (const auto* json = std::get_if<nlohmann::json>(&content)) {
    out << json->dump(2) << "\n";
  } else if (out) {
    std::get<std::function<void(std::ostream&)>>(content)(out);
  }
  out.close();
  std::error_code error(errno, std::generic_category());
  if (out) {
    error = name_durably(part, file);
  } else if (!error) {
    error = std::make_error_code(std::errc::io_error);
  }
  if (!error) return "";
  std::error_code ignored;
  fs::remove(part, ignored);
  return file.string() + " cannot be written (" + error.message() + ")";
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Waits for the names of the folders that it creates.
std::error_code create_durably(const fs::path& folder) {
  std::error_code error;
  if (folder.empty() || fs::is_directory(folder, error)) return {};
  if (fs::exists(folder, error)) return std::make_error_code(std::errc::not_a_directory);
  if (!folder.has_filename()) return create_durably(folder.parent_path());
  error = create_durably(folder.parent_path());
  // Another process may create it at the same time.
  if (!error) fs::create_directory(folder, error);
  return error ? error : await_disk(folder_of(folder));
}

}  // namespace

std::error_code await_disk(const fs::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {errno, std::generic_category()};
  std::error_code error;
  // EINVAL: of a file system that keeps nothing for later.
  if (fsync(descriptor) != 0 && errno != EINVAL) error = {errno, std::generic_category()};
  close(descriptor);
  return error;
}

std::error_code name_durably(const fs::path& part, const fs::path& file) {
  std::error_code error = await_disk(part);
  if (!error) fs::rename(part, file, error);
  if (!error) error = await_disk(folder_of(file));
  return error;
}

std::error_code name_folder_durably(const fs::path& part, const fs::path& folder) {
  std::error_code error;
  fs::recursive_directory_iterator at(part, error);
  for (const fs::recursive_directory_iterator end; !error && at != end;) {
    error = await_disk(at->path());
    if (!error) at.increment(error);
  }
  return error ? error : name_durably(part, folder);
}

void write_whole_file(const fs::path& file, const FileContent& content) {
  if (const std::string failure = write_and_rename(file, content); !failure.empty()) throw RunError(failure);
}

void write_whole_file(const fs::path& file, const std::string& option, const FileContent& content) {
  const std::string failure = write_and_rename(file, content);
  if (!failure.empty()) throw UsageError(option + ": " + failure + "; name another place");
}

void write_with_folder(const fs::path& file, const std::string& text) {
  create_folder(folder_of(file));
  write_whole_file(file, text);
}

void create_folder(const fs::path& folder, const std::string& option) {
  if (const std::error_code error = create_durably(folder)) {
    throw UsageError(option + ": the folder " + folder.string() + " cannot be created (" + error.message() +
                     "); name another");
  }
}

}  // namespace hotpath
