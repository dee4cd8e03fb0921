// SPDX-License-Identifier: Apache-2.0
// Runs a traced program with the preloaded sensor, and reads its rings by their layout alone.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/sensor/ring.hpp"

namespace hotpath::sensor::sensor_test {

namespace fs = std::filesystem;

/// A session with its marker, and the rings of a program that ran in it.
class Session {
 public:
  explicit Session(char digit) : name_(std::string(kSessionDigits - 8, digit) + process_digits()) {
    marker_ = shm_open(marker().c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
    flock(marker_, LOCK_EX);
  }
  ~Session() {
    close(marker_);
    shm_unlink(marker().c_str());
    for (const fs::path& file : files()) fs::remove(file);
    for (Ring* const ring : rings_) munmap(ring, sizeof(Ring));
  }
  void unlock() const { flock(marker_, LOCK_UN); }

  /// The calls that reached the stand-in; a program that fails returns -1.
  long run(const std::string& arguments, const std::string& environment = "",
           const std::string& program = PROGRAM) {
    const std::string command =
        environment + " HOTPATH_WATCH=" + name_ + " LD_PRELOAD=" SENSOR " " + program + " " + arguments;
    const std::unique_ptr<FILE, int (*)(FILE*)> output(popen(command.c_str(), "r"), pclose);
    long calls = -1;
    if (std::fscanf(output.get(), "%ld", &calls) != 1) return -1;
    return calls;
  }

  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator("/dev/shm"))
      if (entry.path().filename().string().starts_with(marker().substr(1) + "."))
        found.push_back(entry.path());
    return found;
  }

  const std::vector<Ring*>& rings() {
    for (const fs::path& file : files()) {
      const int descriptor = open(file.c_str(), O_RDWR);
      struct stat status {};
      fstat(descriptor, &status);
      EXPECT_EQ(status.st_mode & 0777, 0600U);
      EXPECT_EQ(static_cast<std::size_t>(status.st_size), sizeof(Ring));
      rings_.push_back(
          static_cast<Ring*>(mmap(nullptr, sizeof(Ring), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0)));
      close(descriptor);
      fs::remove(file);
    }
    return rings_;
  }

 private:
  static std::string process_digits() {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", static_cast<unsigned>(getpid()));
    return digits.data();
  }
  std::string marker() const { return kNamePrefix + name_; }

  const std::string name_;
  int marker_ = -1;
  std::vector<Ring*> rings_;
};

std::string text_of(const Record& record) { return {record.text, record.length}; }

TEST(Sensor, RecordsCallsAndPassesThemOn) {
  Session session('a');
  EXPECT_EQ(session.run("3 1"), 2 + 3 * 3);
  ASSERT_EQ(session.rings().size(), 1U);
  const Ring& ring = *session.rings().front();
  EXPECT_EQ(ring.magic, kMagic);
  EXPECT_NE(ring.process, ring.thread);
  EXPECT_EQ(ring.ended, 1U);
  EXPECT_EQ(ring.dropped, 0U);
  ASSERT_EQ(ring.head, 3U + 4U + 3U * 3U);
  const Record& node = ring.records[0];
  EXPECT_EQ(node.kind, EventKind::node_init);
  EXPECT_EQ(node.texts, 2);
  EXPECT_EQ(node.number[0], 1U);
  EXPECT_EQ(node.number[1], 2U);
  EXPECT_EQ(text_of(ring.records[1]), "node");
  EXPECT_EQ(text_of(ring.records[2]), "/space");
  EXPECT_EQ(ring.records[2].which, 1);
  EXPECT_EQ(ring.records[3].kind, EventKind::publisher_init);
  EXPECT_EQ(ring.records[3].number[3], 7U);
  EXPECT_EQ(text_of(ring.records[4]) + text_of(ring.records[5]) + text_of(ring.records[6]),
            "/" + std::string(99, 't'));
  const std::array jobs = {EventKind::rmw_take, EventKind::callback_start, EventKind::callback_end};
  for (std::size_t i = 7; i < ring.head; ++i) {
    EXPECT_EQ(ring.records[i].kind, jobs[(i - 7) % 3]);
    EXPECT_GE(ring.records[i].at_ns, ring.records[i == 7 ? 0 : i - 1].at_ns);
    EXPECT_GE(ring.records[i].processor, 0);
  }
  EXPECT_EQ(ring.records[7].number[2], static_cast<std::uint64_t>(-5));
  EXPECT_EQ(ring.records[7].number[3], 1U);
  EXPECT_EQ(ring.records[8].number[0], 10U);
}

TEST(Sensor, CountsWhatAFullRingDrops) {
  Session session('c');
  constexpr std::uint64_t kJobs = 4000;
  EXPECT_EQ(session.run(std::to_string(kJobs) + " 1"), 2 + 3 * static_cast<long>(kJobs));
  ASSERT_EQ(session.rings().size(), 1U);
  EXPECT_EQ(session.rings().front()->head, kCapacity);
  EXPECT_EQ(session.rings().front()->dropped, 7 + 3 * kJobs - kCapacity);
}

TEST(Sensor, CountsTheCallsOfThreadsThatGetNoRing) {
  Session session('8');
  EXPECT_GT(session.run("10 2 limit"), 0);
  ASSERT_EQ(session.rings().size(), 1U);
  EXPECT_EQ(session.rings().front()->head, 2U * (7U + 3U));
  EXPECT_EQ(session.rings().front()->dropped, 2U * (2U + 3U * 10U));
}

TEST(Sensor, GivesAForkedProcessARingOfItsOwn) {
  Session session('d');
  EXPECT_EQ(session.run("0 0 fork"), 5);
  ASSERT_EQ(session.rings().size(), 2U);
  EXPECT_NE(session.rings()[0]->process, session.rings()[1]->process);
  for (const Ring* ring : session.rings()) EXPECT_EQ(ring->head, 7U + 3U);
}

TEST(Sensor, IsSilentWithoutALivingWatcher) {
  Session session('e');
  session.unlock();
  // Nobody asks for rmw_take now, so that the program does not call it.
  EXPECT_EQ(session.run("3 2"), 2 * (2 + 2 * 3));
  EXPECT_EQ(session.run("3 2", "STAND_IN_ENABLED=1"), 2 * (2 + 3 * 3));
  EXPECT_TRUE(session.rings().empty());
}

TEST(Sensor, IsSilentWhereItMayNotWrite) {
  Session session('f');
  EXPECT_EQ(session.run("3 2", "ulimit -f 8;"), 2 * (2 + 2 * 3));
  EXPECT_TRUE(session.rings().empty());
}

TEST(Sensor, RecordsCallsOfHumble) {
  Session session('9');
  EXPECT_EQ(session.run("", "", HUMBLE_PROGRAM), 28);
  ASSERT_EQ(session.rings().size(), 1U);
  const Ring& ring = *session.rings().front();
  std::map<EventKind, const Record*> records;
  for (std::size_t i = 0; i < ring.head; ++i)
    if (ring.records[i].kind != kText) records[ring.records[i].kind] = &ring.records[i];
  EXPECT_EQ(records.size(), 17U);
  for (const auto& [kind, record] : records) EXPECT_EQ(format_of(kind).origin, EventOrigin::humble);
  ASSERT_TRUE(records.contains(EventKind::rmw_publish) && records.contains(EventKind::rmw_take));
  const auto& publish = records[EventKind::rmw_publish]->number;
  EXPECT_EQ((std::array{publish[0], publish[1], publish[2]}), (std::array<std::uint64_t, 3>{0, 9, 0}))
      << "the message alone";
  EXPECT_EQ(records[EventKind::rmw_take]->number[2], 5U);
}

TEST(Sensor, RecordsCallsOfTheRealTracetools) {
  const char* const prefixes = std::getenv("AMENT_PREFIX_PATH");
  const std::string library = (prefixes != nullptr ? std::string(prefixes) : "/opt/ros/jazzy") + "/lib";
  if (!fs::exists(library + "/libtracetools.so")) GTEST_SKIP() << "left out: no ROS 2 was found";
  Session session('0');
  EXPECT_EQ(session.run("1000 2", "LD_LIBRARY_PATH=" + library), 0);  // 0: not the stand-in
  ASSERT_EQ(session.rings().size(), 2U);
  for (const Ring* ring : session.rings()) EXPECT_EQ(ring->head, 7U + 3U * 1000U);
}

}  // namespace hotpath::sensor::sensor_test
