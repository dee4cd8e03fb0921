// SPDX-License-Identifier: Apache-2.0
#include "loaded_libraries.hpp"

#include <link.h>

#include <filesystem>
#include <set>
#include <system_error>

namespace hotpath {

std::vector<std::string> loaded_fast_dds() {
  std::set<std::string> found;
  const auto look = [](dl_phdr_info* library, std::size_t, void* set) {
    const std::filesystem::path path = library->dlpi_name;
    const std::string name = path.filename();
    if (name.starts_with("libfastrtps.so") || name.starts_with("libfastdds.so")) {
      std::error_code error;
      const std::filesystem::path file = canonical(path, error);
      static_cast<std::set<std::string>*>(set)->insert(error ? path : file);
    }
    return 0;
  };
  dl_iterate_phdr(look, &found);
  return {found.begin(), found.end()};
}

}  // namespace hotpath
