// SPDX-License-Identifier: Apache-2.0
#include "hotpath/tracing/ctf_trace.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

namespace hotpath::tracing {

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
  std::uint32_t magic = 0;
  std::memcpy(&magic, head.data(), sizeof magic);
  if (size == head.size() && (magic == 0x75d11d57 || magic == 0x571dd175))  // in either byte order
    return head[35] == 2 ? MetadataFormat::ctf_2 : MetadataFormat::ctf_1;
  if (size > 0 && (head[0] == '\x1e' || head[0] == '{')) return MetadataFormat::ctf_2;
  return std::strncmp(head.data(), "/* CTF 1", 8) == 0 ? MetadataFormat::ctf_1 : MetadataFormat::other;
}

std::vector<fs::path> ctf_folders(const fs::path& folder) {
  const auto refuse = [&](const std::string& reason) { throw TraceError(folder.string() + " " + reason); };
  const auto refuse_reading = [&](const std::error_code& error) {
    refuse("cannot be read (" + error.message() + "); name the folder of a trace");
  };
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (error) refuse_reading(error);
  if (!fs::is_directory(status)) refuse("is not a folder; unpack an archive, and name the folder of a trace");
  std::vector<fs::path> traces;
  // Files may vanish during the search.
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
  if (error) refuse_reading(error);
  if (traces.empty()) {
    refuse(
        "holds no CTF trace: there is no file `metadata` in it or below it; unpack archives, and name the "
        "folder that `lttng create --output` or `ros2 trace` wrote");
  }
  std::ranges::sort(traces);
  return traces;
}

/// Writers that only claim to be LTTng have another packet header.
bool is_of_lttng(const fs::path& folder) {
  std::ifstream metadata(folder / "metadata", std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(metadata), {}};
  return content.find("uint32_t stream_id;") != std::string::npos;
}

/// Bytes of a file up to the end of its last whole packet. Stream files lie beside the metadata,
/// index files in a subfolder. A packet of LTTng 2 begins with magic number (32 bits), UUID (128),
/// stream (32), instance (64), then its context: first and last time, size of the content and of the
/// packet in bits (64 each).
std::uintmax_t whole_bytes(const fs::directory_entry& entry) {
  constexpr std::uint32_t kMagic = 0xc1fc1fc1;
  constexpr std::size_t kPacketSize = 56;
  const std::uintmax_t all = entry.file_size();
  if (entry.path().filename() == "metadata") return all;
  std::ifstream file(entry.path(), std::ios::binary);
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

// The destructor also runs if a constructor throws that delegates to another one.
CtfTrace::CtfTrace(const fs::path& folder) : CtfTrace() {
  folders_ = ctf_folders(folder);
  for (fs::path& trace : folders_) {
    if (!is_of_lttng(trace)) continue;
    const std::string before = cut_;
    for (const auto& entry : fs::directory_iterator(trace)) {
      if (entry.is_regular_file() && whole_bytes(entry) < entry.file_size())
        cut_ += (cut_.empty() ? "within a packet of " : ", ") + entry.path().filename().string();
    }
    if (cut_ != before) trace = copy(trace);
  }
  if (!cut_.empty()) cut_ += ", as when a recording is killed";
}

CtfTrace::~CtfTrace() {
  std::error_code ignored;
  for (const fs::path& folder : copies_) fs::remove_all(folder, ignored);
}

fs::path CtfTrace::copy(const fs::path& folder) {
  std::string name = fs::temp_directory_path() / "hotpath-trace-XXXXXX";
  try {
    if (mkdtemp(name.data()) == nullptr)
      throw fs::filesystem_error("", std::error_code(errno, std::generic_category()));
    copies_.emplace_back(name);
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const fs::path to = copies_.back() / entry.path().filename();
      const std::uintmax_t whole = whole_bytes(entry);
      if (whole == entry.file_size()) {
        fs::create_symlink(fs::absolute(entry.path()), to);
      } else if (whole > 0) {
        fs::copy_file(entry, to);
        fs::resize_file(to, whole);
      }
    }
  } catch (const fs::filesystem_error& error) {
    throw std::runtime_error("a copy of " + folder.string() +
                             " without its incomplete packets cannot be written to " + name + " (" +
                             error.code().message() + "); set TMPDIR to a folder with enough space");
  }
  return name;
}

}  // namespace hotpath::tracing
