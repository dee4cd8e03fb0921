// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/utf8.hpp"

#include <bit>
#include <cstdint>

namespace hotpath {

bool is_utf8(std::string_view text) {
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // by bytes of a sequence
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i + k]));
    };
    const auto ones = static_cast<std::size_t>(std::countl_one(static_cast<unsigned char>(text[i])));
    const std::size_t bytes = ones == 0 ? 1 : ones;
    if (ones == 1 || ones > 4 || bytes > text.size() - i) return false;
    std::uint32_t code = bytes == 1 ? byte(0) : byte(0) & (0x7FU >> bytes);
    for (std::size_t k = 1; k < bytes; ++k) {
      if (byte(k) >> 6 != 0b10) return false;
      code = code << 6 | (byte(k) & 0x3FU);
    }
    if (code < kSmallest[bytes] || code > 0x10FFFF || (code >= 0xD800 && code < 0xE000)) return false;
    i += bytes;
  }
  return true;
}

}  // namespace hotpath
