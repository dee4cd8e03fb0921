// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Folders of CTF traces with nothing but whole packets. Stream files of LTTng that end within a packet, as
/// after a loss of power or on a full disk, libbabeltrace2 refuses as a whole: their folders are replaced by
/// temporary copies without their last packets.
class WholePackets {
 public:
  /// Throws RunError where a copy cannot be made.
  explicit WholePackets(std::vector<std::filesystem::path> folders);
  [[nodiscard]] const std::vector<std::filesystem::path>& folders() const { return folders_; }
  /// What was cut; empty: nothing.
  [[nodiscard]] const std::string& cut() const { return cut_; }

 private:
  std::filesystem::path copy(const std::filesystem::path& folder);

  /// Removed at the end.
  struct Copies {
    Copies() = default;
    Copies(const Copies&) = delete;
    Copies& operator=(const Copies&) = delete;
    ~Copies();
    std::vector<std::filesystem::path> folders;
  };
  Copies copies_;
  std::vector<std::filesystem::path> folders_;
  std::string cut_;
};

}  // namespace hotpath
