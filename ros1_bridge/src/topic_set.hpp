// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ros_publisher.hpp"

namespace hotpath {

/// The topics of one type, which change with the run.
template <class Output>
class TopicSet {
 public:
  using Publisher = RosPublisher<Output>;

  /// Publishers of exactly these topics, in this order. Existing topics keep their publishers, so
  /// that their subscribers stay connected.
  std::vector<Publisher> advertise(const std::vector<std::string>& topics, std::uint32_t queue) {
    std::map<std::string, Publisher> now;
    std::vector<Publisher> publishers;
    for (const std::string& topic : topics) {
      auto known = topics_.extract(topic);
      Publisher publisher = known.empty() ? Publisher(topic, {queue, false}) : std::move(known.mapped());
      publishers.push_back(publisher);
      now.emplace(topic, std::move(publisher));
    }
    topics_ = std::move(now);
    return publishers;
  }

 private:
  std::map<std::string, Publisher> topics_;
};

}  // namespace hotpath
