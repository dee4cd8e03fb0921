// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <tuple>
#include <type_traits>

#include "hotpath/analysis/waters_experiment.hpp"

namespace hotpath {

namespace {

constexpr std::uint64_t kMagic = 0x3130737265746177;  // "waters01"

template <typename T>
void append(std::string& bytes, const std::vector<T>& items) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T));
}

template <typename T>
void extract(const char*& from, std::vector<T>& items) {
  if (items.empty()) return;
  std::memcpy(static_cast<void*>(items.data()), from, items.size() * sizeof(T));
  from += items.size() * sizeof(T);
}

}  // namespace

WatersResult join_waters(const std::vector<WatersResult>& shares) {
  WatersResult all;
  for (const WatersResult& share : shares) {
    all.sets.insert(all.sets.end(), share.sets.begin(), share.sets.end());
    all.rows.insert(all.rows.end(), share.rows.begin(), share.rows.end());
  }
  std::sort(all.sets.begin(), all.sets.end(), [](const WatersSet& a, const WatersSet& b) {
    return std::tie(a.level, a.set) < std::tie(b.level, b.set);
  });
  std::sort(all.rows.begin(), all.rows.end(), [](const WatersRow& a, const WatersRow& b) {
    return std::tie(a.level, a.set, a.chain) < std::tie(b.level, b.set, b.chain);
  });
  return all;
}

std::string pack_waters(const WatersResult& share) {
  std::string bytes;
  append(bytes, std::vector<std::uint64_t>{kMagic, share.sets.size(), share.rows.size()});
  append(bytes, share.sets);
  append(bytes, share.rows);
  return bytes;
}

WatersResult unpack_waters(const std::string& bytes) {
  std::vector<std::uint64_t> head(3);
  const char* from = bytes.data();
  const std::size_t head_bytes = head.size() * sizeof(head[0]);
  if (bytes.size() >= head_bytes) extract(from, head);
  const std::size_t body = bytes.size() - std::min(bytes.size(), head_bytes);
  if (head[0] != kMagic || head[1] > body / sizeof(WatersSet) || head[2] > body / sizeof(WatersRow) ||
      body != head[1] * sizeof(WatersSet) + head[2] * sizeof(WatersRow)) {
    throw AnalysisError("these " + std::to_string(bytes.size()) +
                        " bytes are not part of a WATERS experiment; run the same program on all ranks");
  }
  WatersResult share;
  share.sets.resize(head[1]);
  share.rows.resize(head[2]);
  extract(from, share.sets);
  extract(from, share.rows);
  return share;
}

}  // namespace hotpath
