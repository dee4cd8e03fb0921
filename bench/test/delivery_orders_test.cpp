// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

namespace hotpath::delivery_orders_test {

using testing::ElementsAre;
using Kind = tracing::Endpoint::Kind;

constexpr std::uint64_t kFastDds = 0x010f'0000'0000'0001, kOther = 0x0110'0000'0000'0001;

/// A process whose endpoints are numbered in the order of creation, as Fast DDS numbers them.
struct Process {
  explicit Process(std::uint64_t of_vendor = kFastDds) : vendor(of_vendor) {
    system.nodes = {"/node"};
    system.topics = {{"/a", {}}, {"/b", {}}};
  }
  void publisher(std::uint32_t topic) { add(Kind::publisher, topic).publications = 1; }
  void subscription(std::uint32_t topic) {
    const auto c = static_cast<std::uint32_t>(system.callbacks.size());
    add(Kind::subscription, topic).callback = c;
    system.callbacks.emplace_back().samples = 1;
    system.topics[topic].subscriptions.push_back(c);
  }
  void service() {
    system.endpoints.emplace_back().kind = Kind::service;
    number += 2;
  }
  imports::RecordedDeliveries deliveries() const { return imports::created_deliveries(system); }

  tracing::System system;
  std::uint64_t vendor, number = 0;

 private:
  tracing::Endpoint& add(Kind kind, std::uint32_t topic) {
    tracing::Endpoint& added = system.endpoints.emplace_back();
    added.kind = kind;
    added.topic = topic;
    ++number;
    if (vendor != 0) added.id = {vendor, std::uint64_t{0x55} << 32 | number << 8 | 4};
    return added;
  }
};

TEST(DeliveryOrders, SubscribersAfterTheirPublisherAreReachedInTheOrderOfCreation) {
  for (const std::uint64_t vendor : {kFastDds, std::uint64_t{0}}) {
    Process process(vendor);
    process.publisher(0);
    process.subscription(0);
    process.service();
    process.subscription(0);
    const imports::RecordedDeliveries all = process.deliveries();
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all.begin()->second.source, imports::DeliverySource::creation);
    EXPECT_THAT(all.begin()->second.subscriptions, ElementsAre(0, 1));
  }
}

TEST(DeliveryOrders, AreUnknownIfSomeEndpointOrTheMiddlewareIs) {
  for (const std::uint64_t vendor : {kFastDds, kOther, std::uint64_t{0}}) {
    Process process(vendor);
    process.subscription(1);
    if (vendor == kFastDds) ++process.number;  // an endpoint of which the trace has no event
    process.subscription(0);
    process.subscription(0);
    process.publisher(0);
    EXPECT_EQ(process.deliveries().begin()->second.source, imports::DeliverySource::unknown);
  }
}

TEST(DeliveryOrders, AreUnknownIfSeveralReadersLieInOtherProcesses) {
  for (const std::size_t elsewhere : {0U, 1U, 2U}) {
    Process process;
    process.publisher(0);
    for (int i = 0; i < 4; ++i) process.subscription(0);
    for (std::size_t i = 0; i < elsewhere; ++i) process.system.endpoints.at(4 - i).process = 8;
    EXPECT_EQ(process.deliveries().begin()->second.source,
              elsewhere < 2 ? imports::DeliverySource::creation : imports::DeliverySource::unknown);
  }
}

TEST(DeliveryOrders, TheOrderOfStartsCountsWhereSamplesAreQueuedByArrival) {
  Process process(0);
  process.subscription(0);
  process.subscription(0);
  process.publisher(0);
  std::vector<tracing::Job> jobs;
  for (std::uint64_t message = 0; message < 10; ++message) {
    const bool swapped = message == 4;
    for (const std::uint32_t callback : {swapped ? 0U : 1U, swapped ? 1U : 0U}) {
      tracing::Job& job = jobs.emplace_back();
      job.ref = {callback, message};
      job.has_sample = true;
      job.sample.parent = {5, message};
    }
  }
  const imports::RecordedDeliveries created = process.deliveries();
  const std::vector<std::uint32_t> one_executor = {0, 0}, two_executors = {0, 1};
  const auto adds = [&](std::span<const tracing::Job> of, Family family, const auto& executors) {
    imports::RecordedDeliveries all = created;
    return add_started_deliveries(all, of, family, executors);
  };
  EXPECT_FALSE(adds(std::span(jobs).subspan(6, 4), Family::events, one_executor)) << "no majority";
  EXPECT_FALSE(adds(jobs, Family::priority_events, one_executor));
  EXPECT_FALSE(adds(jobs, Family::events, two_executors));
  imports::RecordedDeliveries deliveries = created;
  EXPECT_TRUE(add_started_deliveries(deliveries, jobs, Family::events, one_executor));
  const imports::RecordedDelivery& delivery = deliveries.begin()->second;
  EXPECT_EQ(delivery.source, imports::DeliverySource::starts);
  EXPECT_THAT(delivery.subscriptions, ElementsAre(1, 0));
  EXPECT_EQ(delivery.messages, 10U);
  EXPECT_EQ(delivery.agreeing, 9U);
  EXPECT_THAT(delivery_notes(process.system, deliveries), ElementsAre(testing::HasSubstr("/a (1 of 10)")));
}

}  // namespace hotpath::delivery_orders_test
