// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>

#include "hotpath/tracing/ctf_trace.hpp"

namespace hotpath::tracing::ctf_test {

namespace fs = std::filesystem;

class Ctf : public testing::Test {
 protected:
  Ctf() { EXPECT_NE(mkdtemp(name_.data()), nullptr); }
  ~Ctf() override { fs::remove_all(name_); }

  /// One event of each kind, alternating between two processors, with a distinct value per field.
  static std::vector<Event> one_of_each_kind() {
    std::vector<Event> events;
    for (const EventFormat& format : kEvents) {
      const auto i = static_cast<std::uint32_t>(events.size());
      Event e{format.kind, 7, 100 + i, static_cast<std::int32_t>(i % 2), Time(Duration(1'000'000 + 10 * i))};
      std::size_t numbers = 0, texts = 0;
      for (const EventField& field : format.fields()) {
        if (field.type == FieldType::text) {
          e.text[texts++] = field.name;
          continue;
        }
        for (int n = field.type == FieldType::gid ? 2 : 1; n > 0; --n, ++numbers) {
          e.number[numbers] = 1000 * (i + 1) + numbers;
        }
      }
      events.push_back(e);
    }
    return events;
  }

  std::vector<std::string> lines_of_assembled(const std::vector<Event>& events) const {
    std::vector<std::string> lines;
    for (const Event& e : events)
      if (format_of(e.kind).role != EventRole::only_kept) lines.push_back(line(e));
    return lines;
  }

  static std::string line(const Event& e) {
    std::string line = format_of(e.kind).name;
    for (const std::int64_t number : {e.at.time_since_epoch().count(), std::int64_t{e.process},
                                      std::int64_t{e.thread}, std::int64_t{e.processor}})
      line += ' ' + std::to_string(number);
    for (const std::uint64_t number : e.number) line += ' ' + std::to_string(number);
    for (const char* const text : e.text) line += std::string(" ") + text;
    return line;
  }

  static void expect_error(const fs::path& folder, const char* said) {
    EXPECT_THAT([&] { const CtfTrace trace(folder); },
                testing::ThrowsMessage<TraceError>(testing::HasSubstr(said)));
  }

  std::string name_ = fs::temp_directory_path() / "hotpath-ctf-test-XXXXXX";
};

TEST_F(Ctf, EventsAreReadAsTheyWereWritten) {
  const fs::path folder = fs::path(name_) / "trace";
  const std::vector<Event> events = one_of_each_kind();
  write_ctf(folder, events, "test");
  std::vector<std::string> seen;
  const TraceReading reading = CtfTrace(name_).read([&](const Event& e) { seen.push_back(line(e)); });
  EXPECT_EQ(seen, lines_of_assembled(events));
  EXPECT_EQ(reading.all_events, events.size());
  EXPECT_EQ(reading.events.at("ros2:rcl_take"), 1U);  // not assembled, but counted
  EXPECT_EQ(reading.length(), events.back().at - events.front().at);
  EXPECT_EQ(reading.longest_gap, Duration(10));
  EXPECT_EQ(reading.broken_off, "");
}

TEST_F(Ctf, ExceptionsOfTheVisitorEndTheReading) {
  write_ctf(fs::path(name_) / "trace", one_of_each_kind(), "test");
  const auto visit = [](const Event&) { throw std::length_error("enough"); };
  EXPECT_THROW(static_cast<void>(CtfTrace(name_).read(visit)), std::length_error);
}

TEST_F(Ctf, FoldersWithoutATraceAreRejectedWithARemedy) {
  expect_error(fs::path(name_) / "nowhere", "cannot be read (No such file");
  expect_error(name_, "holds no CTF trace");
  std::ofstream(fs::path(name_) / "metadata") << "{\"type\": \"preamble\"}";
  expect_error(name_, "--trace-format=ctf-1.8");
  std::ofstream(fs::path(name_) / "metadata") << "text";
  expect_error(name_, "is not CTF");
}

}  // namespace hotpath::tracing::ctf_test
