// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Makes traces of LTTng readable whose stream files end within a packet, as after a loss of power or on a
/// full disk: libbabeltrace2 refuses such files as a whole.
class WholePackets {
 public:
  WholePackets() = default;
  WholePackets(const WholePackets&) = delete;
  WholePackets& operator=(const WholePackets&) = delete;
  /// Removes the copies.
  ~WholePackets();

  /// Replaces folders with cut files by temporary copies without their last packets. Returns what was cut, or
  /// nothing. Throws RunError where a copy cannot be made.
  [[nodiscard]] std::string replace_cut(std::vector<std::filesystem::path>& folders);

 private:
  std::filesystem::path copy(const std::filesystem::path& folder);

  std::vector<std::filesystem::path> copies_;
};

}  // namespace hotpath
