// SPDX-License-Identifier: Apache-2.0
#include "program/whole_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "program/errors.hpp"

namespace hotpath {

void write_whole_file(const std::filesystem::path& file, const std::string& option,
                      const std::function<void(std::ostream&)>& write) {
  const std::filesystem::path part = file.string() + ".part";
  errno = 0;
  std::ofstream out(part, std::ios::binary);
  if (out) write(out);
  out.close();
  int cause = out ? 0 : errno;
  if (cause == 0 && out) {
    std::error_code error;
    std::filesystem::rename(part, file, error);
    cause = error.value();
  }
  if (out && cause == 0) return;
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  throw UsageError(option + ": " + file.string() + " cannot be written (" + std::strerror(cause) +
                   "); name another place");
}

}  // namespace hotpath
