// SPDX-License-Identifier: Apache-2.0
#include "watch_relay.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

namespace hotpath {

namespace {

constexpr int kSecond_ms = 1000, kSilence_s = 3;

/// Reads lines, with a limit on the time and on the length of a line.
class Lines {
 public:
  enum class Input { line, time_out, end };

  explicit Lines(int descriptor) : descriptor_(descriptor) {}

  /// Waits at most a second for more bytes, less if a signal arrives. A last line without its end is
  /// dropped: the writer was killed. Throws NoReport.
  Input next(std::string& line) {
    while (!take(line)) {
      pollfd input{descriptor_, POLLIN, 0};
      if (poll(&input, 1, kSecond_ms) <= 0) return Input::time_out;
      std::array<char, 65536> bytes;
      const ssize_t length = read(descriptor_, bytes.data(), bytes.size());
      if (length < 0 && (errno == EINTR || errno == EAGAIN)) return Input::time_out;
      if (length <= 0) return Input::end;
      buffer_.append(bytes.data(), static_cast<std::size_t>(length));
      if (buffer_.size() > kMost) throw NoReport("a line has more than 64 MiB");
    }
    return Input::line;
  }

 private:
  static constexpr std::size_t kMost = std::size_t{64} << 20;  // 200,000 callbacks with their names

  bool take(std::string& line) {
    const std::size_t end = buffer_.find('\n', searched_);
    searched_ = end == std::string::npos ? buffer_.size() : 0;
    if (end == std::string::npos) return false;
    line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    return true;
  }

  const int descriptor_;
  std::string buffer_;
  std::size_t searched_ = 0;  // no line ends before
};

}  // namespace

void relay_watch(int descriptor, const std::function<bool()>& goes_on,
                 const std::function<void(const std::vector<WatchStatus>&)>& publish) {
  Lines lines(descriptor);
  WatchStatuses statuses;
  std::string line;
  for (int silence_s = 0; goes_on();) {
    switch (lines.next(line)) {
      case Lines::Input::line:
        silence_s = 0;
        publish(statuses.of(line));
        break;
      case Lines::Input::time_out:
        if (++silence_s >= kSilence_s) publish(statuses.stale("the watcher is silent"));
        break;
      case Lines::Input::end:
        return publish(statuses.stale("the watcher has ended"));
    }
  }
}

}  // namespace hotpath
