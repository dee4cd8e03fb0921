// SPDX-License-Identifier: Apache-2.0
#include "import/delivery_orders.hpp"

#include <gmock/gmock.h>

#include "hotpath/tracing/assembler.hpp"

namespace hotpath {
namespace {

using testing::ElementsAre;
using K = tracing::EventKind;

constexpr std::uint64_t kFastDds = 0x010f'0000'0000'0001, kOther = 0x0110'0000'0000'0001;

/// A process whose endpoints are numbered in the order of creation, as Fast DDS numbers them.
class Process : public tracing::Sink {
 public:
  explicit Process(std::uint32_t id = 7, std::uint64_t vendor = kFastDds) : id_(id), vendor_(vendor) {
    tell(K::node_init, {1, 2}, {"node", "/"});
  }

  void publisher(const char* topic) {
    const std::uint64_t handle = named(K::rmw_publisher_init);
    tell(K::publisher_init, {handle + 1, 1, handle, 1}, {topic, ""});
    publishers_.push_back(handle + 1);
  }
  /// Returns the number of its callback.
  std::uint32_t subscription(const char* topic) {
    const std::uint64_t handle = named(K::rmw_subscription_init);
    tell(K::subscription_init, {handle + 1, 1, handle, 1}, {topic, ""});
    tell(K::rclcpp_subscription_init, {handle + 1, handle + 2});
    tell(K::subscription_callback_added, {handle + 2, handle + 3});
    return callbacks_++;
  }
  void service() {
    tell(K::service_init, {handle_ += 10, 1});
    number_ += 2;
  }
  /// An endpoint of which the trace has no event.
  void untraced() { ++number_; }

  void ended(tracing::Job&&) override {}
  void lost(const tracing::LostSample&) override {}

  /// After a message of each publisher: endpoints without any do not count.
  imports::RecordedDeliveries deliveries() {
    for (const std::uint64_t publisher : publishers_) tell(K::rcl_publish, {publisher, 9});
    return imports::created_deliveries(assembler_.system());
  }
  const tracing::System& system() const { return assembler_.system(); }

 private:
  std::uint64_t named(K kind) {
    handle_ += 10;
    ++number_;
    if (vendor_ != 0) tell(kind, {handle_, vendor_, std::uint64_t{0x55} << 32 | number_ << 8 | 4});
    return handle_;
  }
  void tell(K kind, const std::array<std::uint64_t, 4>& numbers,
            const std::array<const char*, 2>& text = {"", ""}) {
    assembler_.event({kind, id_, id_, 0, from_ns(++at_), numbers, text});
  }

  tracing::Assembler assembler_{*this};
  std::vector<std::uint64_t> publishers_;
  std::uint32_t id_, callbacks_ = 0;
  std::uint64_t vendor_, handle_ = 100, number_ = 0;
  std::int64_t at_ = 0;
};

TEST(DeliveryOrders, SubscribersAfterTheirPublisherAreReachedInTheOrderOfCreation) {
  for (const std::uint64_t vendor : {kFastDds, std::uint64_t{0}}) {
    Process process(7, vendor);
    process.publisher("/a");
    process.subscription("/a");
    process.service();
    process.subscription("/a");
    const imports::RecordedDeliveries all = process.deliveries();
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all.begin()->second.source, imports::DeliverySource::creation);
    EXPECT_THAT(all.begin()->second.subscriptions, ElementsAre(0, 1));
  }
}

/// libstdc++ puts a key into an empty bucket first, and reverses keys when the table grows from 1 to 13
/// buckets, with the second reader. import_test.py has orders of real systems.
TEST(DeliveryOrders, SubscribersBeforeTheirPublisherFollowTheTableOfReaders) {
  Process process;
  for (int i = 0; i < 3; ++i) process.subscription("/a");
  process.service();
  process.publisher("/a");
  process.subscription("/a");
  const imports::RecordedDelivery delivery = process.deliveries().begin()->second;
  EXPECT_EQ(delivery.source, imports::DeliverySource::ids);
  EXPECT_THAT(delivery.subscriptions, ElementsAre(2, 0, 1, 3));
}

TEST(DeliveryOrders, AreUnknownIfSomeEndpointOrTheMiddlewareIs) {
  const auto source = [](Process& process) {
    process.subscription("/a");
    process.subscription("/a");
    process.publisher("/a");
    return process.deliveries().begin()->second.source;
  };
  Process gap, other(7, kOther), without(7, 0);
  gap.subscription("/b");
  gap.untraced();
  EXPECT_EQ(source(gap), imports::DeliverySource::unknown);
  EXPECT_EQ(source(other), imports::DeliverySource::unknown);
  EXPECT_EQ(source(without), imports::DeliverySource::unknown);
}

TEST(DeliveryOrders, AreUnknownIfSeveralReadersLieInOtherProcesses) {
  Process process;
  process.publisher("/a");
  for (int i = 0; i < 4; ++i) process.subscription("/a");
  tracing::System system = process.system();
  for (tracing::Endpoint& endpoint : system.endpoints) endpoint.publications = 1;
  for (tracing::Callback& callback : system.callbacks) callback.samples = 1;
  const auto source = [&](std::size_t elsewhere) {
    tracing::System split = system;
    for (std::size_t i = 0; i < elsewhere; ++i)
      split.endpoints.at(split.endpoints.size() - 1 - i).process = 8;
    return imports::created_deliveries(split).begin()->second.source;
  };
  EXPECT_EQ(source(0), imports::DeliverySource::creation);
  EXPECT_EQ(source(1), imports::DeliverySource::creation);
  EXPECT_EQ(source(2), imports::DeliverySource::unknown);
}

TEST(DeliveryOrders, TheOrderOfStartsCountsWhereSamplesAreQueuedByArrival) {
  Process process(7, 0);
  process.subscription("/a");
  process.subscription("/a");
  process.publisher("/a");
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
  const std::vector<std::uint32_t> one_executor = {0, 0}, two_executors = {0, 1};
  imports::RecordedDeliveries even = process.deliveries();
  const std::span<const tracing::Job> two_messages = std::span(jobs).subspan(6, 4);
  EXPECT_FALSE(add_started_deliveries(two_messages, Family::events, one_executor, even)) << "no majority";
  imports::RecordedDeliveries deliveries = process.deliveries();
  EXPECT_FALSE(add_started_deliveries(jobs, Family::priority_events, one_executor, deliveries));
  EXPECT_FALSE(add_started_deliveries(jobs, Family::events, two_executors, deliveries));
  EXPECT_EQ(deliveries.begin()->second.source, imports::DeliverySource::unknown);
  EXPECT_TRUE(add_started_deliveries(jobs, Family::events, one_executor, deliveries));
  const imports::RecordedDelivery& delivery = deliveries.begin()->second;
  EXPECT_EQ(delivery.source, imports::DeliverySource::starts);
  EXPECT_THAT(delivery.subscriptions, ElementsAre(1, 0));
  EXPECT_EQ(delivery.messages, 10U);
  EXPECT_EQ(delivery.agreeing, 9U);
  EXPECT_THAT(delivery_notes(process.system(), deliveries), ElementsAre(testing::HasSubstr("/a (1 of 10)")));
}

}  // namespace
}  // namespace hotpath
