// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <unordered_set>

namespace hotpath::watch {

/// Keeps the texts of events, each once, for its own lifetime.
class Texts {
 public:
  /// Empty once kMost different texts were kept.
  const char* keep(std::string text) {
    if (const auto kept = texts_.find(text); kept != texts_.end()) return kept->c_str();
    return texts_.size() < kMost ? texts_.insert(std::move(text)).first->c_str() : "";
  }

 private:
  static constexpr std::size_t kMost = 100'000;  // nodes and topics of a system: some thousands
  std::unordered_set<std::string> texts_;
};

}  // namespace hotpath::watch
