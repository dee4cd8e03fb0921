// SPDX-License-Identifier: Apache-2.0
#include "import/ctf_folders.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

#include "program/errors.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 100'000;  // a trace has a few hundred

enum class MetadataFormat { ctf_1, ctf_2, other };

/// CTF 1.8, section 7.1: metadata is text, or packets that begin with a magic number, of which
/// bytes 35 and 36 are the version. CTF 2: a sequence of JSON texts, each behind a record
/// separator.
MetadataFormat format_of(const fs::path& metadata) {
  std::ifstream file(metadata, std::ios::binary);
  std::array<char, 37> head{};
  file.read(head.data(), head.size());
  const auto size = static_cast<std::size_t>(file.gcount());
  constexpr std::array<unsigned char, 4> kMagic = {0x57, 0x1d, 0xd1, 0x75};  // 0x75d11d57
  std::array<unsigned char, 4> first{}, last{};
  std::memcpy(first.data(), head.data(), first.size());
  std::reverse_copy(first.begin(), first.end(), last.begin());
  if (size == head.size() && (first == kMagic || last == kMagic)) {
    return head[35] == 2 ? MetadataFormat::ctf_2 : MetadataFormat::ctf_1;
  }
  if (size > 0 && (head[0] == '\x1e' || head[0] == '{')) return MetadataFormat::ctf_2;
  return std::strncmp(head.data(), "/* CTF 1", 8) == 0 ? MetadataFormat::ctf_1 : MetadataFormat::other;
}

}  // namespace

std::vector<fs::path> ctf_folders(const fs::path& folder) {
  const auto refuse = [&](const std::string& reason) { throw UsageError(folder.string() + " " + reason); };
  if (!fs::is_directory(folder)) refuse("is not a folder; name the folder of a trace");
  std::vector<fs::path> traces;
  std::error_code error;  // files may vanish during the search
  fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error);
  std::size_t files = 0;
  for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) {
    if (++files > kMostFiles) refuse("holds more than 100000 files; name the folder of a trace");
    const fs::path& path = at->path();
    std::error_code gone;
    if (path.filename() != "metadata" || !fs::is_regular_file(path, gone)) continue;
    const MetadataFormat format = format_of(path);
    if (format == MetadataFormat::ctf_2) {
      refuse(
          "holds a trace in CTF 2, which libbabeltrace2 2.0 cannot read; record with `lttng create "
          "--trace-format=ctf-1.8`, or convert it with babeltrace2 2.1: `babeltrace2 TRACE --component "
          "sink.ctf.fs --params='path=\"NEW\",ctf-version=\"1\"'`");
    }
    if (format == MetadataFormat::other)
      refuse("has a file `metadata` that is not CTF; name the folder of a trace");
    traces.push_back(path.parent_path());
  }
  if (error) refuse("cannot be searched (" + error.message() + "); name the folder of a trace");
  if (traces.empty()) {
    refuse(
        "holds no CTF trace: there is no file `metadata` in it or below it; name the folder that "
        "`lttng create --output` or `ros2 trace` wrote");
  }
  std::ranges::sort(traces);
  return traces;
}

}  // namespace hotpath
