// SPDX-License-Identifier: Apache-2.0
#include "program/whole_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <iostream>

#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"

namespace hotpath::program {

namespace fs = std::filesystem;

namespace {

void write(std::ostream& out, const FileContent& content) {
  if (const auto* text = std::get_if<std::string>(&content)) {
    out << *text;
  } else if (const auto* document = std::get_if<nlohmann::json>(&content)) {
    out << document->dump(2) << "\n";
  } else {
    std::get<std::function<void(std::ostream&)>>(content)(out);
  }
}

/// Writes the content and closes the descriptor.
std::error_code write_to(int descriptor, const FileContent& content) {
  if (descriptor < 0) return {errno, std::generic_category()};
  errno = 0;
  FileStream out(descriptor);
  write(out, content);
  out.close();
  if (out) return {};
  return errno != 0 ? std::error_code(errno, std::generic_category())
                    : std::make_error_code(std::errc::io_error);
}

/// A new file or folder beside its final name, under a unique hidden name.
class Part {
 public:
  /// `create` creates it, and returns false with errno set on failure.
  template <class Create>
  Part(const fs::path& final_name, Create create) {
    static std::atomic<unsigned> count = 0;
    constexpr std::size_t kLongest = 200;  // keeps the temporary name below the limit of the file system
    constexpr int kAttempts = 1000;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      path_ = folder_of(final_name) / concat(".", final_name.filename().string().substr(0, kLongest), ".",
                                             getpid(), "-", count++, ".part");
      errno = 0;
      if (create(path_)) return;
      if (errno != EEXIST) break;
    }
    error_ = {errno, std::generic_category()};
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;
  ~Part() {
    std::error_code ignored;
    if (!error_) fs::remove_all(path_, ignored);  // no effect after the rename
  }

  const fs::path& path() const { return path_; }
  std::error_code error() const { return error_; }

 private:
  fs::path path_;
  std::error_code error_;
};

/// Gives a new file the owner and permissions of the file that it will replace, if any.
void take_over_permissions(int descriptor, const fs::path& replaced) {
  struct stat old {};
  if (lstat(replaced.c_str(), &old) != 0 || !S_ISREG(old.st_mode)) return;
  // If the old owner cannot be set, the file keeps the permissions of a new file.
  if (fchown(descriptor, old.st_uid, old.st_gid) == 0) fchmod(descriptor, old.st_mode & 07777);
}

std::error_code replace(const fs::path& file, const FileContent& content) {
  int descriptor = -1;
  const Part part(file, [&](const fs::path& path) { return (descriptor = create_file(path)) >= 0; });
  if (part.error()) return part.error();
  take_over_permissions(descriptor, file);
  const std::error_code error = write_to(descriptor, content);
  return error ? error : name_durably(part.path(), file);
}

/// Writes into a device, a FIFO, or an open descriptor.
std::error_code write_in_place(const OutputTarget& target, const FileContent& content) {
  std::cout << std::flush;  // earlier output comes first
  std::fflush(stdout);
  const int descriptor = target.descriptor >= 0 ? fcntl(target.descriptor, F_DUPFD_CLOEXEC, 0)
                                                : open(target.name.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
  return write_to(descriptor, content);
}

std::string cannot_be_written(const fs::path& file, const std::error_code& error) {
  return file.string() + " cannot be written (" + error.message() + ")";
}

/// Creates a folder and its parents, and syncs their directory entries.
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

int create_file(const fs::path& file) {
  return open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

FileStream::FileStream(int descriptor) : std::ostream(nullptr) {
  if (descriptor < 0) return;
  buffer_ = __gnu_cxx::stdio_filebuf<char>(descriptor, std::ios::out | std::ios::binary);
  rdbuf(&buffer_);
}

void FileStream::close() {
  if (buffer_.is_open() && buffer_.close() == nullptr) setstate(std::ios::failbit);
}

std::error_code await_disk(const fs::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {errno, std::generic_category()};
  std::error_code error;
  // EINVAL: the file system does not support synchronisation.
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

void write_whole_folder(const fs::path& folder, const std::function<void(const fs::path&)>& write) {
  const fs::path file = folder.has_filename() ? folder : folder.parent_path();  // without a slash at its end
  const fs::path name = find_target(file).name;
  const Part part(name, [](const fs::path& path) { return mkdir(path.c_str(), 0777) == 0; });
  if (part.error()) throw RunError(cannot_be_written(folder, part.error()));
  const fs::path filled = part.path() / name.filename();
  write(filled);
  std::error_code error;
  fs::recursive_directory_iterator at(filled, error);
  for (const fs::recursive_directory_iterator end; !error && at != end;) {
    error = await_disk(at->path());
    if (!error) at.increment(error);
  }
  if (!error) error = await_disk(filled);
  if (!error) fs::rename(filled, name, error);
  if (!error) fs::remove(part.path(), error);  // before the parent's entries are synced
  if (!error) error = await_disk(folder_of(name));
  if (error) throw RunError(cannot_be_written(folder, error));
}

void write_whole_file(const fs::path& file, const FileContent& content) {
  if (const std::error_code error = replace(file, content)) throw RunError(cannot_be_written(file, error));
}

void write_whole_file(const fs::path& file, const std::string& option, const FileContent& content) {
  require(replace(file, content), option, file.string() + " cannot be written", " place");
}

void write_output_file(const fs::path& file, const std::string& option, const FileContent& content) {
  check_output_file(file, option);
  const OutputTarget target = find_target(file);
  require(target.in_place ? write_in_place(target, content) : replace(target.name, content), option,
          file.string() + " cannot be written", " place");
}

void write_with_folder(const fs::path& file, const std::string& text) {
  create_folder(folder_of(file));
  write_whole_file(file, text);
}

void create_folder(const fs::path& folder, const std::string& option) {
  require(create_durably(folder), option, "the folder " + folder.string() + " cannot be created");
}

}  // namespace hotpath::program
