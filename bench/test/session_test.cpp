// SPDX-License-Identifier: Apache-2.0
#include "watch/session.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>
#include <string>

#include "hotpath/sensor/ring.hpp"

namespace hotpath::watch::session_test {

using tracing::Event;
using tracing::EventKind;

tracing::Time now() { return std::chrono::steady_clock::now(); }

void run(const Session& session, const std::string& arguments) {
  const std::string command = std::string(sensor::kSessionVariable) + "=" + session.name() +
                              " LD_PRELOAD=" SENSOR " " PROGRAM " " + arguments + " >/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
}

bool is_left(const std::string& session) {
  return std::ranges::any_of(std::filesystem::directory_iterator("/dev/shm"), [&](const auto& entry) {
    return entry.path().filename().string().find(session) != std::string::npos;
  });
}

TEST(Session, MergesTheThreadsOfAProgramByTime) {
  std::string name;
  {
    Session session;
    name = session.name();
    run(session, "100 4");
    const std::vector<Event> events = session.finish(now());
    ASSERT_EQ(events.size(), 4U * (2U + 3U * 100U));
    EXPECT_TRUE(std::ranges::is_sorted(events, {}, &Event::at));
    std::set<std::uint32_t> threads, processes;
    for (const Event& event : events) {
      threads.insert(event.thread);
      processes.insert(event.process);
    }
    EXPECT_EQ(threads.size(), 4U);
    EXPECT_EQ(processes.size(), 1U);
    EXPECT_EQ(session.threads(), 4U);
    const auto node = std::ranges::find(events, EventKind::node_init, &Event::kind);
    EXPECT_STREQ(node->text[0], "node");
    EXPECT_STREQ(node->text[1], "/space");
    EXPECT_THAT(session.losses(), testing::FieldsAre(0U, 0U, 0U));
    EXPECT_TRUE(is_left(name));
  }
  EXPECT_FALSE(is_left(name));
}

TEST(Session, LeavesTheRingsOfAttachablePrograms) {
  // As long as the marker of a session; process 1 lives.
  std::string ring = sensor::kNamePrefix;
  ring.append(sensor::kAttachable).append(".0001.0123456789abcdef");
  ASSERT_EQ(ring.size(), std::strlen(sensor::kNamePrefix) + sensor::kSessionDigits);
  const int file = shm_open(ring.c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_GE(file, 0);
  close(file);
  { const Session session; }
  EXPECT_EQ(shm_unlink(ring.c_str()), 0);
}

TEST(Session, CountsDroppedEvents) {
  Session session;
  run(session, "4000 1");
  EXPECT_EQ(session.finish(now()).size() + session.losses().dropped, 2U + 3U * 4000U);
  EXPECT_GT(session.losses().dropped, 0U);
}

TEST(Session, HoldsBackEventsThatMayHavePredecessors) {
  Session session;
  const tracing::Time before = now();
  run(session, "1 1");
  EXPECT_TRUE(session.poll(before).empty());
  EXPECT_EQ(session.poll(now() + Session::kSettled).size(), 2U + 3U);
}

}  // namespace hotpath::watch::session_test
