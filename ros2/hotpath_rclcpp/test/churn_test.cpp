// SPDX-License-Identifier: Apache-2.0
// Nodes, timers, subscriptions and groups come and go at random while the executor spins; every sample that
// reached a subscription that stays is accounted for. HOTPATH_CHURN_SECONDS: how long, by default 3.
#include <atomic>
#include <cstdlib>
#include <random>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using std_msgs::msg::Int32;

struct Guest {
  rclcpp::Node::SharedPtr node;
  std::vector<rclcpp::TimerBase::SharedPtr> timers;
  std::vector<rclcpp::SubscriptionBase::SharedPtr> subscriptions;
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups;
  std::shared_ptr<std::atomic_bool> gone = std::make_shared<std::atomic_bool>(false);
};

class Churn : public EveryExecutor {
 protected:
  static std::chrono::milliseconds length() {
    const char* seconds = std::getenv("HOTPATH_CHURN_SECONDS");
    return std::chrono::seconds(seconds == nullptr ? 3 : std::atoi(seconds));
  }
};

INSTANTIATE_TEST_SUITE_P(Executors, Churn,
                         testing::Values("rm-ro", "rm-re", "edf-ro", "cbg", "rm-ro:2", "single"), case_name);

TEST_P(Churn, EveryCallbackIsAccountedFor) {
  std::mt19937 random(1);
  const auto chance = [&](unsigned of) { return std::uniform_int_distribution<unsigned>(0, of - 1)(random); };
  std::atomic_int stayed{0}, ticks{0};
  const auto subscription = node->create_subscription<Int32>("stays", rclcpp::QoS(rclcpp::KeepLast(100)),
                                                             [&](Int32::ConstSharedPtr) { ++stayed; });
  const auto publisher = node->create_publisher<Int32>("stays", rclcpp::QoS(rclcpp::KeepLast(100)));
  const auto timer = node->create_wall_timer(5ms, [&] { ++ticks; });
  executor->add_node(node);
  ASSERT_TRUE(eventually([&] { return publisher->get_subscription_count() == 1; }));
  int published = 0;
  {
    const Spinning spinning(*executor);
    std::vector<Guest> guests;
    int names = 0;
    const auto leave = [&](std::size_t i) {
      executor->remove_node(guests[i].node);
      *guests[i].gone = true;
      guests.erase(guests.begin() + static_cast<std::ptrdiff_t>(i));
    };
    const auto end = std::chrono::steady_clock::now() + length();
    while (std::chrono::steady_clock::now() < end) {
      switch (chance(8)) {
        case 0: {
          if (guests.size() > 6) break;
          Guest& guest = guests.emplace_back();
          guest.node = std::make_shared<rclcpp::Node>("guest" + std::to_string(names++),
                                                      rclcpp::NodeOptions().start_parameter_services(false));
          executor->add_node(guest.node);
          break;
        }
        case 1:
          if (!guests.empty() && chance(3) == 0) leave(chance(static_cast<unsigned>(guests.size())));
          break;
        case 2:
        case 3: {
          if (guests.empty()) break;
          Guest& guest = guests[chance(static_cast<unsigned>(guests.size()))];
          if (guest.timers.size() < 5) {
            guest.groups.push_back(guest.node->create_callback_group(
                chance(2) == 0 ? rclcpp::CallbackGroupType::Reentrant
                               : rclcpp::CallbackGroupType::MutuallyExclusive));
            guest.timers.push_back(guest.node->create_wall_timer(
                1ms + 1ms * chance(5), [gone = guest.gone] { static_cast<void>(gone); },
                guest.groups.back()));
          } else {
            guest.timers.erase(guest.timers.begin());
            guest.groups.erase(guest.groups.begin());
          }
          break;
        }
        case 4: {
          if (guests.empty()) break;
          Guest& guest = guests[chance(static_cast<unsigned>(guests.size()))];
          for (const auto& t : guest.timers) chance(2) == 0 ? t->cancel() : t->reset();
          break;
        }
        case 5: {
          if (guests.empty()) break;
          Guest& guest = guests[chance(static_cast<unsigned>(guests.size()))];
          guest.subscriptions.clear();
          guest.subscriptions.push_back(
              guest.node->create_subscription<Int32>("stays", 10, [](Int32::ConstSharedPtr) {}));
          break;
        }
        default:
          publisher->publish(Int32());
          ++published;
          EXPECT_TRUE(eventually([&] { return published - stayed < 50; }));
      }
    }
    const int before = ticks;
    EXPECT_TRUE(eventually([&] { return stayed == published; })) << stayed << " of " << published;
    EXPECT_TRUE(eventually([&] { return ticks > before; }));
    while (!guests.empty()) leave(0);
  }
  EXPECT_EQ(stayed, published);
}

}  // namespace
}  // namespace hotpath::test
