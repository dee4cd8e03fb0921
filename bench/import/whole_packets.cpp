// SPDX-License-Identifier: Apache-2.0
#include "import/whole_packets.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// Writers that only claim to be LTTng have another packet header.
bool is_of_lttng(const fs::path& folder) {
  std::ifstream metadata(folder / "metadata", std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(metadata), {}};
  return content.find("uint32_t stream_id;") != std::string::npos;
}

/// Stream files lie beside the metadata, index files in a subfolder.
bool is_stream(const fs::directory_entry& entry) {
  return entry.is_regular_file() && entry.path().filename() != "metadata";
}

/// Bytes of a stream file up to the end of its last whole packet. A packet of LTTng 2 begins with
/// magic number (32 bits), UUID (128), stream (32), instance (64), then its context: first and last
/// time, size of the content and of the packet in bits (64 each).
std::uintmax_t whole_bytes(const fs::path& stream) {
  constexpr std::uint32_t kMagic = 0xc1fc1fc1;
  constexpr std::size_t kPacketSize = 56;
  const std::uintmax_t all = fs::file_size(stream);
  std::ifstream file(stream, std::ios::binary);
  std::array<char, kPacketSize + 8> head{};
  std::uintmax_t at = 0;
  while (at < all) {
    std::uint32_t magic = 0;
    std::uint64_t bits = 0;
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(head.data(), head.size())) return at;
    std::memcpy(&magic, head.data(), sizeof magic);
    std::memcpy(&bits, head.data() + kPacketSize, sizeof bits);
    if (magic != kMagic || bits < 8 * head.size() || bits / 8 > all - at) return at;
    at += bits / 8;
  }
  return at;
}

}  // namespace

WholePackets::Copies::~Copies() {
  std::error_code ignored;
  for (const fs::path& copy : folders) fs::remove_all(copy, ignored);
}

WholePackets::WholePackets(std::vector<fs::path> folders) : folders_(std::move(folders)) {
  std::vector<std::string> cut;
  for (fs::path& folder : folders_) {
    if (!is_of_lttng(folder)) continue;
    const std::size_t before = cut.size();
    for (const auto& entry : fs::directory_iterator(folder))
      if (is_stream(entry) && whole_bytes(entry) < entry.file_size()) cut.push_back(entry.path().filename());
    if (cut.size() > before) folder = copy(folder);
  }
  if (cut.empty()) return;
  cut_ = concat("within a packet of ", joined(cut, ", "), ", as when a recording is killed");
}

fs::path WholePackets::copy(const fs::path& folder) {
  std::string name = fs::temp_directory_path() / "hotpath-trace-XXXXXX";
  try {
    if (mkdtemp(name.data()) == nullptr)
      throw fs::filesystem_error("", std::error_code(errno, std::generic_category()));
    copies_.folders.emplace_back(name);
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const fs::path to = fs::path(name) / entry.path().filename();
      const std::uintmax_t whole = is_stream(entry) ? whole_bytes(entry) : entry.file_size();
      if (whole == entry.file_size()) {
        fs::create_symlink(fs::absolute(entry.path()), to);
      } else if (whole > 0) {
        fs::copy_file(entry, to);
        fs::resize_file(to, whole);
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw RunError(concat("a copy of ", folder.string(),
                          " without its incomplete packets cannot be written to ", name, " (",
                          error.code().message(), "); set TMPDIR to a folder with enough space"));
  }
  return name;
}

}  // namespace hotpath
