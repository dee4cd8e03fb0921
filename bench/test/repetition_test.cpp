// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "hotpath/reference_system/run_channel.hpp"
#include "live/repetition_runner.hpp"
#include "machine/shared_memory_watch.hpp"
#include "reference_nodes.hpp"

namespace hotpath::repetition_test {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Two timers, one of which starts a chain; the nodes do no work.
Graph idle_graph() {
  Graph g;
  g.nodes = {reference_node("Lidar", NodeType::sensor, {}, milliseconds(20)),
             reference_node("Camera", NodeType::sensor, {}, milliseconds(20)),
             reference_node("Filter", NodeType::transform, {{"Lidar", 10, {}}}),
             reference_node("Logger", NodeType::command, {{"Filter", 10, {}}})};
  g.chains = {{"path", {"Lidar", "Filter", "Logger"}, {"Lidar"}, "Logger"}};
  return g;
}

TEST(AssignProcesses, NodesAreSharedOutInCreationOrderAndAsEvenlyAsPossible) {
  const Graph graph = idle_graph();
  EXPECT_THAT(live::assign_processes(graph, 1), ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(live::assign_processes(graph, 2), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(live::assign_processes(graph, 3), ElementsAre(0, 0, 1, 2));
  EXPECT_THAT(live::assign_processes(graph, 4), ElementsAre(0, 1, 2, 3));
}

TEST(Repetition, ProcessThatCannotBeSetUpIsAFailureOfThePlanAndIsNotLeft) {
  const Graph graph = idle_graph();
  live::Plan plan;
  plan.graph = &graph;
  plan.tasks = make_tasks(graph);
  plan.executor = setup::parse_executor("events-ro", {});
  plan.transport = TransportKind::intra_process;
  plan.cpus = {100000};
  const live::Result result = live::run_repetition(plan, [](Duration) {});
  EXPECT_TRUE(result.setup_failed);
  EXPECT_FALSE(result.measured);
  EXPECT_THAT(result.failure, HasSubstr("100000"));
  EXPECT_THAT(result.repetition.trace.jobs, IsEmpty());
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

/// Maps a file of /dev/shm (its own: `container`) and holds another one open, until it is killed.
class SharedMemoryUser {
 public:
  explicit SharedMemoryUser(const std::string& name = "hotpath_test_", bool container = false)
      : name_(name + std::to_string(getpid())) {
    const ForkedProcess user = fork_process([this, container](const Channel& test) -> int {
      if (container && (unshare(CLONE_NEWNS) || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) ||
                        mount("tmpfs", "/dev/shm", "tmpfs", 0, nullptr)))
        return 1;
      const int mapped = open(segment().c_str(), O_CREAT | O_RDWR, 0600);
      open(lock_file().c_str(), O_CREAT | O_RDWR, 0600);
      const bool done =
          ftruncate(mapped, 4096) == 0 && mmap(nullptr, 4096, PROT_READ, MAP_SHARED, mapped, 0) != MAP_FAILED;
      close(mapped);
      if (done) test.send(ChannelMessage::Kind::matched);
      for (;;) pause();
    });
    process_ = user.id;
    ready_ = user.channel.receive(std::chrono::steady_clock::now() + std::chrono::seconds(30)).has_value();
  }
  ~SharedMemoryUser() {
    end();
    std::filesystem::remove(segment());
    std::filesystem::remove(lock_file());
    std::filesystem::remove(semaphore());
  }
  void end() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
    process_ = -1;
  }
  bool ready() const { return ready_; }
  pid_t process() const { return process_; }
  std::string segment() const { return "/dev/shm/" + name_; }
  std::string lock_file() const { return "/dev/shm/" + name_ + "_el"; }
  std::string semaphore() const { return "/dev/shm/sem." + name_ + "_mutex"; }

 private:
  const std::string name_;
  pid_t process_ = -1;
  bool ready_ = false;
};

TEST(SharedMemoryWatch, RemovesWhatANotedProcessLeftBehindWhenItIsDead) {
  SharedMemoryUser user;
  ASSERT_TRUE(user.ready());
  std::ofstream(user.semaphore()) << "";
  machine::SharedMemoryWatch watch, blind;
  watch.note(user.process());
  watch.remove_orphans();
  for (const std::string& file : {user.segment(), user.lock_file()})
    EXPECT_TRUE(std::filesystem::exists(file)) << "a living process uses it";
  user.end();
  blind.remove_orphans();
  EXPECT_TRUE(std::filesystem::exists(user.segment())) << "it has not noted the process";
  watch.remove_orphans();
  for (const std::string& file : {user.segment(), user.lock_file(), user.semaphore()})
    EXPECT_FALSE(std::filesystem::exists(file)) << file;
}

TEST(SharedMemoryWatch, RemovesWhatFastDdsMadeJustBeforeItsProcessDied) {
  SharedMemoryUser earlier("fastrtps_test_earlier_");
  ASSERT_TRUE(earlier.ready());
  earlier.end();
  machine::SharedMemoryWatch watch;
  SharedMemoryUser living("fastrtps_test_living_"), dead("fastrtps_test_dead_");
  ASSERT_TRUE(living.ready() && dead.ready());
  // Root can make one that has files of the same names in another /dev/shm.
  const SharedMemoryUser elsewhere("fastrtps_test_dead_", true);
  dead.end();
  watch.remove_orphans();
  EXPECT_TRUE(std::filesystem::exists(earlier.segment()));
  EXPECT_TRUE(std::filesystem::exists(living.segment()));
  EXPECT_FALSE(std::filesystem::exists(dead.segment()));
  EXPECT_FALSE(std::filesystem::exists(dead.lock_file()));
}

}  // namespace hotpath::repetition_test
