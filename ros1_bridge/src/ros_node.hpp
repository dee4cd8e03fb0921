// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ros/ros.h>

#include <atomic>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "master.hpp"

namespace hotpath {

/// The URI of the node that the master knows by the name of this process; empty: none.
std::string registered_uri();

/// Registers all topics of this node again whenever roscore is restarted, in a thread of its own,
/// until it is destroyed. Connections to subscribers persist.
class Registration {
 public:
  explicit Registration(const HostAndPort& master);
  ~Registration();
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

 private:
  void watch();

  const HostAndPort master_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

/// Logs publishers of `topic` with another type: subscribers accept only one type, and roscpp does
/// not report it to publishers.
void report_other_type(const std::string& topic, const std::string& type);

/// Messages queued for each subscriber of a topic.
inline constexpr std::uint32_t kQueue = 1000;

/// `topic` is relative to the node's namespace unless it starts with a slash. roscpp drops the oldest
/// message if a subscriber falls `queue` behind. A new subscriber of a `latched` topic gets the last
/// message. Waits for the master.
template <class Message>
ros::Publisher advertise(const std::string& topic, std::uint32_t queue = kQueue, bool latched = false) {
  ros::NodeHandle node;
  report_other_type(node.resolveName(topic), ros::message_traits::DataType<Message>::value());
  return node.advertise<Message>(topic, queue, latched);
}

/// The topics of one type, which change with the run.
using Topics = std::map<std::string, ros::Publisher>;

/// Makes `topics` exactly `prefix` with each of these names, and returns their publishers in this
/// order. Existing topics keep their publishers, so that their subscribers stay connected.
template <class Message>
std::vector<ros::Publisher> advertise_all(Topics& topics, const std::string& prefix,
                                          const std::vector<std::string>& names) {
  Topics now;
  std::vector<ros::Publisher> publishers;
  for (const std::string& name : names) {
    const auto known = topics.find(prefix + name);
    publishers.push_back(known != topics.end() ? known->second : advertise<Message>(prefix + name));
    now.emplace(prefix + name, publishers.back());
  }
  topics = std::move(now);
  return publishers;
}

/// A message whose only field is `data`.
template <class Message, class Data>
Message message_of(const Data& data) {
  Message message;
  message.data = data;
  return message;
}

}  // namespace hotpath
