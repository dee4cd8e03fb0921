// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hotpath {

/// Folders of CTF traces with complete packets only. libbabeltrace2 rejects a stream file of LTTng
/// that ends within a packet, as after a power loss or on a full disk. The folders of these files
/// are replaced by temporary copies without the incomplete packets.
class WholePackets {
 public:
  /// Throws RunError if a copy cannot be written.
  explicit WholePackets(std::vector<std::filesystem::path> folders);
  [[nodiscard]] const std::vector<std::filesystem::path>& folders() const { return folders_; }
  /// Where the trace was cut; empty: it was complete.
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
