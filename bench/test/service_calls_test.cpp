// SPDX-License-Identifier: Apache-2.0
// Who calls a service.
#include "import/recorded_executors.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using tracing::Duration, tracing::Time;
using K = tracing::CallbackKind;

/// A service (callback 0) of node 0, and callbacks of node 1, which has a client of it.
struct Recorded {
  tracing::System system;
  std::vector<tracing::Job> jobs;

  explicit Recorded(std::uint32_t callbacks) {
    system.nodes = {"/server", "/user"};
    system.topics = {{"/map", {}}};
    system.clients = {{.node = 1, .service = 0}};
    for (std::uint32_t c = 0; c <= callbacks; ++c) {
      tracing::Callback& callback = system.callbacks.emplace_back();
      callback.kind = c == 0 ? K::service : K::timer;
      callback.node = c == 0 ? 0 : 1;
      if (c == 0) callback.topic = 0;
    }
  }
  void job(std::uint32_t callback, Duration start) {
    tracing::Job& job = jobs.emplace_back();
    job.ref = {callback, system.callbacks[callback].jobs++};
    job.start = Time{} + start;
    job.finish = job.start + 1ms;
    job.sample.published = job.start;
  }
  std::vector<std::string> attribute() {
    std::ranges::sort(jobs, {}, &tracing::Job::start);
    return imports::attribute_requests(system, jobs);
  }
  /// The callbacks to which requests were attributed.
  [[nodiscard]] std::set<std::uint32_t> callers() const {
    std::set<std::uint32_t> found;
    for (const tracing::Job& job : jobs)
      if (job.ref.callback == 0) found.insert(job.sample.parent.callback);
    return found;
  }
};

TEST(ServiceCalls, AreOfTheCallbackThatRanAsOften) {
  Recorded r(2);
  for (int i = 0; i < 20; ++i) {
    r.job(1, i * 50ms);
    r.job(2, i * 50ms + 2ms);
    r.job(2, i * 50ms + 4ms);  // too often, though nearer
    r.job(0, i * 50ms + 10ms);
  }
  EXPECT_THAT(r.attribute(),
              testing::ElementsAre(testing::HasSubstr("node /user is taken to send the requests")));
  EXPECT_EQ(r.callers(), std::set<std::uint32_t>{1});
  EXPECT_EQ(r.jobs.front().published.size(), 1U);
  EXPECT_EQ(r.jobs.back().sample.published, r.jobs.back().start - 9ms);
}

TEST(ServiceCalls, OfSeveralTheNearestIsTaken) {
  Recorded r(2);
  for (int i = 0; i < 20; ++i) {
    r.job(1, i * 50ms);
    r.job(2, i * 50ms + 5ms);
    r.job(0, i * 50ms + 10ms);
  }
  EXPECT_EQ(r.attribute().size(), 1U);
  EXPECT_EQ(r.callers(), std::set<std::uint32_t>{2});
}

TEST(ServiceCalls, WithoutAClientOrARelationNobodyCalls) {
  for (const bool client : {false, true}) {
    Recorded r(1);
    if (!client) r.system.clients.clear();
    for (int i = 0; i < 20; ++i) {
      r.job(1, i * 50ms);
      r.job(0, client ? i * i * 10ms + 10ms : i * 50ms + 10ms);
    }
    EXPECT_TRUE(r.attribute().empty());
    EXPECT_EQ(r.callers(), std::set<std::uint32_t>{tracing::kNone});
  }
}

}  // namespace
}  // namespace hotpath
