// SPDX-License-Identifier: Apache-2.0
// What `hotpath watch --json` says, on /diagnostics.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <nlohmann/json.hpp>

#include "executors.hpp"
#include "watch_statuses.hpp"

namespace hotpath::test {
namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using nlohmann::json;
using Level = WatchStatus::Level;

json term(const std::string& callback, const std::string& name, const std::string& verdict, int checked,
          int broken) {
  return {{"callback", callback}, {"term", name},       {"limit", 5.0},     {"from", "given"},
          {"verdict", verdict},   {"checked", checked}, {"broken", broken}, {"reason", "the reason"}};
}

json report(const json& terms) {
  return {{"time_s", 1.0},
          {"processes", 1},
          {"threads", 2},
          {"events", 30},
          {"dropped", 0},
          {"damaged", 0},
          {"late", 0},
          {"ignored_entities", 0},
          {"callbacks",
           {{{"name", "/source (timer 10 ms)"},
             {"rate", 100.0},
             {"jobs", 100},
             {"lost", 0},
             {"execution_ms", {{"p99", 1.0}, {"max", 2.0}}},
             {"response_ms", nullptr}}}},
          {"contract", {{"terms", terms}, {"incident", ""}}}};
}

/// The status of this name; its absence fails the test.
WatchStatus named(const std::vector<WatchStatus>& statuses, const std::string& name) {
  for (const WatchStatus& status : statuses)
    if (status.name == name) return status;
  ADD_FAILURE() << "no status " << name;
  return {};
}

TEST(Statuses, NameTheWatcherCallbacksAndSubjectsOfTheContract) {
  const auto statuses =
      WatchStatuses().of(report(json::array({term("source (timer)", "budget_ms", "held", 100, 0)})).dump());
  ASSERT_EQ(statuses.size(), 3U);
  EXPECT_EQ(statuses[0].name, "hotpath watch");
  EXPECT_EQ(statuses[1].name, "hotpath watch: /source (timer 10 ms)");
  EXPECT_EQ(statuses[1].message, "100.0 jobs/s");
  EXPECT_EQ(statuses[2].name, "hotpath contract: source (timer)");
  for (const WatchStatus& status : statuses) EXPECT_EQ(status.level, Level::ok) << status.name;
}

TEST(Statuses, StateAnIncidentAtOnce) {
  WatchStatuses statuses;
  const auto event = statuses.of(R"({"event": "incident", "number": 1, "incident": "source ran 6 ms"})");
  ASSERT_EQ(event.size(), 1U);
  EXPECT_EQ(event[0].name, "hotpath watch: incident");
  EXPECT_EQ(event[0].level, Level::error);
  EXPECT_EQ(event[0].message, "source ran 6 ms");
  const auto later = statuses.of(report(json::array()).dump());
  EXPECT_EQ(named(later, "hotpath watch: incident").level, Level::warn);
}

TEST(Statuses, OfABrokenTermAreErrorsOnlyWhileItIsBrokenAgain) {
  WatchStatuses statuses;
  const std::string subject = "hotpath contract: filter/points";
  const auto level = [&](const std::string& verdict, int broken) {
    const json terms = {term("filter/points", "budget_ms", verdict, 100, broken),
                        term("filter/points", "depth", "held", 100, 0)};
    return named(statuses.of(report(terms).dump()), subject).level;
  };
  EXPECT_EQ(level("held", 0), Level::ok);
  EXPECT_EQ(level("broken", 1), Level::error);
  EXPECT_EQ(level("broken", 1), Level::warn);
  EXPECT_EQ(level("broken", 3), Level::error);
}

TEST(Statuses, AreStaleWhereNoTermCanBeJudgedAndWarnWhereEventsWereLost) {
  const std::string subject = "hotpath contract: a (timer)";
  const auto status = [&](int checked) {
    return named(
        WatchStatuses().of(
            report(json::array({term("a (timer)", "budget_ms", "not observable", checked, 0)})).dump()),
        subject);
  };
  EXPECT_EQ(status(0).level, Level::stale);
  EXPECT_EQ(status(100).level, Level::warn);
  EXPECT_EQ(status(100).message, "budget_ms not observable: the reason");
  json held_and_not = report(
      {term("a (timer)", "depth", "not observable", 0, 0), term("a (timer)", "budget_ms", "held", 9, 0)});
  EXPECT_EQ(named(WatchStatuses().of(held_and_not.dump()), subject).level, Level::ok);
}

TEST(Statuses, NameWhateverATermIsAbout) {
  json threads = term("", "policy", "held", 9, 0);
  threads.erase("callback");
  threads["thread"] = "executor";
  threads["limit"] = "fifo:80";
  threads["advice"] = "a key of a later version";
  threads["observed"] = nullptr;
  const auto status =
      named(WatchStatuses().of(report(json::array({threads})).dump()), "hotpath contract: thread executor");
  EXPECT_EQ(status.level, Level::ok);
  EXPECT_EQ(status.values[0], (std::array<std::string, 2>{"policy", "fifo:80"}));
}

TEST(Statuses, OfTheWatcherWarnWhileEventsAreLost) {
  WatchStatuses statuses;
  json line = report(json::array());
  line["dropped"] = 4;
  EXPECT_EQ(statuses.of(line.dump())[0].level, Level::warn);
  EXPECT_EQ(statuses.of(line.dump())[0].level, Level::ok);
  EXPECT_EQ(statuses.stale("silent")[0].level, Level::stale);
}

TEST(Statuses, HaveDifferentNames) {
  json line = report(json::array());
  line["callbacks"].push_back(line["callbacks"][0]);
  const auto statuses = WatchStatuses().of(line.dump());
  EXPECT_EQ(statuses[2].name, statuses[1].name + " #2");
}

TEST(Statuses, RejectOtherLines) {
  for (const char* const line : {"", "callback  jobs/s", "[]", "{}", "{\"time_s\": 1}"})
    EXPECT_THROW(WatchStatuses().of(line), NoReport) << line;
}

class Node : public testing::Test {
 protected:
  void SetUp() override {
    rclcpp::init(0, nullptr);
    node_ = std::make_shared<rclcpp::Node>("monitor");
    received_ = node_->create_subscription<DiagnosticArray>(
        "/diagnostics", rclcpp::QoS(100),
        [this](DiagnosticArray::ConstSharedPtr array) { arrays_.push_back(*array); });
  }
  void TearDown() override {
    if (input_ >= 0) close(input_);
    received_.reset();
    node_.reset();
    rclcpp::shutdown();
  }

  /// Runs a command of the shell, whose standard input is `input_`.
  pid_t start(const std::string& command) {
    int ends[2];
    if (pipe(ends) != 0) return -1;
    const pid_t id = fork();
    if (id == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      dup2(ends[0], STDIN_FILENO);
      close(ends[0]), close(ends[1]);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    close(ends[0]);
    input_ = ends[1];
    return id;
  }
  void write_line(const std::string& text) const {
    const std::string line = text + "\n";
    ASSERT_EQ(write(input_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }
  void end_input() {
    close(input_);
    input_ = -1;
  }
  /// Spins until the condition holds; false after a limit that suits a busy machine.
  template <class Condition>
  bool spin_until(Condition condition) {
    return eventually([&] {
      rclcpp::spin_some(node_);
      return condition();
    });
  }
  /// The level of a status in the latest message; -1: it has none of this name.
  int level(const std::string& name) const {
    if (arrays_.empty()) return -1;
    for (const auto& status : arrays_.back().status)
      if (status.name == name) return status.level;
    return -1;
  }
  static int exit_code(pid_t id) {
    int status = 0;
    waitpid(id, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  rclcpp::Node::SharedPtr node_;
  rclcpp::Subscription<DiagnosticArray>::SharedPtr received_;
  std::vector<DiagnosticArray> arrays_;
  int input_ = -1;
};

TEST_F(Node, PublishesEachLineAndEndsWithTheWatcher) {
  const pid_t id = start(HOTPATH_DIAGNOSTICS);
  int broken = 0;
  ASSERT_TRUE(spin_until([&] {  // lines before the two are connected are lost
    write_line(report(json::array({term("source (timer)", "budget_ms", "broken", 100, ++broken)})).dump());
    return level("hotpath contract: source (timer)") == 2;
  }));
  EXPECT_EQ(level("hotpath watch"), 0);
  EXPECT_GT(arrays_.back().header.stamp.sec, 0);
  end_input();
  ASSERT_TRUE(spin_until([&] { return level("hotpath watch") == 3; }));
  EXPECT_EQ(level("hotpath contract: source (timer)"), 3);
  EXPECT_EQ(exit_code(id), 0);
}

TEST_F(Node, RejectsOtherInputAndArguments) {
  const pid_t id = start(HOTPATH_DIAGNOSTICS " 2> /dev/null");
  write_line("callback  jobs/s");
  EXPECT_EQ(exit_code(id), 1);
  EXPECT_EQ(exit_code(start(HOTPATH_DIAGNOSTICS " --json 2> /dev/null")), 2);
}

TEST_F(Node, ShowsARunningSystem) {
  const char* const command = std::getenv("HOTPATH_COMMAND");
  const std::string hotpath = command != nullptr ? command : "hotpath";
  if (std::system((hotpath + " watch --once -- true > /dev/null 2>&1").c_str()) != 0)
    GTEST_SKIP() << "left out: the command hotpath or its sensor is not there";
  const pid_t id = start(hotpath + " watch --json --for 3 -- " + HOTPATH_WATCHED +
                         " single 100 2> /dev/null | exec " + HOTPATH_DIAGNOSTICS);
  EXPECT_TRUE(spin_until([&] { return level("hotpath watch: /perception/sink /perception/objects") == 0; }));
  EXPECT_TRUE(spin_until([&] { return level("hotpath watch") == 3; }));
  EXPECT_EQ(exit_code(id), 0);
}

}  // namespace
}  // namespace hotpath::test
