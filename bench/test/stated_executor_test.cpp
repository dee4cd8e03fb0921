// SPDX-License-Identifier: Apache-2.0
// An executor that describes itself in a CTF trace (hotpath_rclcpp's PriorityExecutor).
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "hotpath/tracing/assembler.hpp"
#include "hotpath/tracing/ctf_trace.hpp"
#include "hotpath/tracing/ctf_writer.hpp"
#include "import/interpretation.hpp"

namespace hotpath {
namespace {

namespace fs = std::filesystem;
using K = tracing::EventKind;
using Numbers = std::array<std::uint64_t, 4>;
using Texts = std::array<const char*, 2>;

constexpr std::int64_t kMs = 1'000'000;

/// Two timers of 10 ms that are due together: `slow` runs first, as its priority demands and its
/// creation does not. Only `levels` says that, since `quick` has none. Then the events of
/// `executor`, if it is not empty.
std::vector<tracing::Event> events(const char* executor) {
  std::vector<tracing::Event> all;
  const auto tell = [&](std::int64_t ns, K kind, const Numbers& number, const Texts& text = {"", ""}) {
    all.push_back({kind, 7, 1, 0, from_ns(ns), number, text});
  };
  tell(0, K::node_init, {1, 2}, {"quick", "/"});
  tell(0, K::node_init, {3, 4}, {"slow", "/"});
  for (const std::uint64_t node : {1U, 3U}) {
    tell(1, K::timer_init, {10 * node, 10 * kMs});
    tell(1, K::timer_callback_added, {10 * node, 10 * node + 1});
    tell(1, K::timer_link_node, {10 * node, node});
  }
  if (*executor != '\0') {
    tell(2, K::executor_init, {90}, {executor, "priorities.yaml"});
    tell(3, K::executor_callback, {90, 0, 10}, {"timer", ""});
    tell(3, K::executor_callback, {90, 1, 30}, {"timer", ""});
    tell(4, K::executor_priority, {90, 0, std::numeric_limits<std::int64_t>::max()});
    tell(4, K::executor_priority, {90, 1, 8});
    tell(4, K::executor_priority, {90, 1, 5});  // changed
  }
  for (std::int64_t at = 10 * kMs; at < 1000 * kMs; at += 10 * kMs) {
    for (const std::uint64_t task : {1U, 0U}) {
      const std::uint64_t callback = task == 0 ? 11 : 31;
      const std::int64_t start = at + 1000 + (task == 0 ? 3 * kMs : 0);
      if (*executor != '\0') tell(start - 10, K::executor_job, {90, task});
      tell(start, K::callback_start, {callback});
      tell(start + 2 * kMs, K::callback_end, {callback});
    }
  }
  return all;
}

/// The import of a CTF trace with these events.
class Imported : public tracing::Sink {
 public:
  explicit Imported(const char* executor) {
    std::string folder = fs::temp_directory_path() / "hotpath-stated-XXXXXX";
    if (mkdtemp(folder.data()) == nullptr) std::abort();
    tracing::write_ctf(fs::path(folder) / "trace", events(executor), "test");
    static_cast<void>(tracing::CtfTrace(folder).read([&](const tracing::Event& e) { assembler_.event(e); }));
    fs::remove_all(folder);
    assembler_.finish();
    imports::CtfOptions options;
    options.trace = "traces/stated";
    result = imports::interpret(recording, options);
  }
  void ended(tracing::Job&& job) override { recording.jobs.push_back(std::move(job)); }
  void lost(const tracing::LostSample& sample) override { recording.lost.push_back(sample); }

 private:
  tracing::Assembler assembler_{*this};

 public:
  imports::Recording recording{
      .system = assembler_.system(), .jobs = {}, .lost = {}, .deployment_file = "deployment.yaml"};
  imports::Interpretations result;
};

TEST(StatedExecutor, NamesItselfAndItsPriorities) {
  Imported imported("fp-ro:first");
  const imports::Recognition& recognition = imported.recording.recognitions.front();
  EXPECT_EQ(recognition.verdict, imports::Verdict::recognised);
  EXPECT_EQ(recognition.stated, "fp-ro:first");
  EXPECT_EQ(imported.result.best.labels, (std::vector<std::string>{"fp-ro:first"}));
  const Graph& graph = imported.result.best.graph;
  EXPECT_EQ(graph.nodes[1].callbacks.front().priority, 5);
  EXPECT_FALSE(graph.nodes[0].callbacks.front().priority);
  EXPECT_EQ(imported.result.best.check.light, imports::Light::green);
}

TEST(StatedExecutor, WithoutItsEventsDecisionsDecide) {
  Imported imported("");
  const imports::Recognition& recognition = imported.recording.recognitions.front();
  EXPECT_EQ(recognition.stated, "");
  EXPECT_GT(recognition.ranking.size(), 1U);
}

TEST(StatedExecutor, UnknownNamesDecideNothing) {
  Imported imported("llf-ro");
  EXPECT_EQ(imported.recording.recognitions.front().stated, "");
  EXPECT_GT(imported.recording.recognitions.front().ranking.size(), 1U);
}

}  // namespace
}  // namespace hotpath
