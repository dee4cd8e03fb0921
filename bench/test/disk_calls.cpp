// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that logs a command's file system calls below the folder
// HOTPATH_DISK_FOLDER. It appends each successful fsync, fdatasync, mkdir and rename to the file
// HOTPATH_DISK_LOG: a line `KIND INODE SIZE<tab>PATH<tab>NEW PATH`, then SIZE bytes of the file's
// content or, for a folder, of lines `INODE NAME`. power_loss_test.py reads the log.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace {

std::string absolute(const char* path) {
  std::error_code error;
  return std::filesystem::absolute(path, error).lexically_normal().string();
}

std::string content_of(const std::string& path, bool is_folder) {
  std::string content;
  if (is_folder) {
    DIR* const folder = opendir(path.c_str());
    if (folder == nullptr) abort();
    while (const dirent* const entry = readdir(folder)) {
      const std::string name = entry->d_name;
      if (name != "." && name != "..") content += std::to_string(entry->d_ino) + " " + name + "\n";
    }
    closedir(folder);
    return content;
  }
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) abort();
  char block[65536];
  for (ssize_t n = 0; (n = read(file, block, sizeof block)) > 0;)
    content.append(block, static_cast<std::size_t>(n));
  close(file);
  return content;
}

/// Appends an entry in one write, so that entries of several processes do not mix.
void note(const char* kind, const std::string& path, const std::string& renamed = "") {
  const char* const below = getenv("HOTPATH_DISK_FOLDER");
  const char* const log = getenv("HOTPATH_DISK_LOG");
  if (below == nullptr || log == nullptr || !path.starts_with(below)) return;
  const int before = errno;
  struct stat facts {};
  const std::string& now = renamed.empty() ? path : renamed;
  if (stat(now.c_str(), &facts) != 0) abort();
  const std::string content = content_of(now, S_ISDIR(facts.st_mode));
  const std::string entry = std::string(kind) + (S_ISDIR(facts.st_mode) ? "-folder " : "-file ") +
                            std::to_string(facts.st_ino) + " " + std::to_string(content.size()) + "\t" +
                            path + "\t" + renamed + "\n" + content;
  const int file = open(log, O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file < 0 || write(file, entry.data(), entry.size()) != static_cast<ssize_t>(entry.size())) abort();
  close(file);
  errno = before;
}

int noted_wait(int result, int file) {
  char path[PATH_MAX];
  const ssize_t size =
      result == 0 ? readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path) : -1;
  if (size > 0) note("wait", std::string(path, static_cast<std::size_t>(size)));
  return result;
}

}  // namespace

extern "C" {

int fsync(int file) { return noted_wait(static_cast<int>(syscall(SYS_fsync, file)), file); }
int fdatasync(int file) { return noted_wait(static_cast<int>(syscall(SYS_fdatasync, file)), file); }

int mkdir(const char* path, mode_t mode) {
  const auto result = static_cast<int>(syscall(SYS_mkdirat, AT_FDCWD, path, mode));
  if (result == 0) note("make", absolute(path));
  return result;
}

int rename(const char* from, const char* to) {
  static const auto real = reinterpret_cast<int (*)(const char*, const char*)>(dlsym(RTLD_NEXT, "rename"));
  const int result = real(from, to);
  if (result == 0) note("rename", absolute(from), absolute(to));
  return result;
}

}  // extern "C"
