// SPDX-License-Identifier: Apache-2.0
#include "ros_publisher.hpp"

#include <ros/ros.h>

#include "ros_messages.hpp"

namespace hotpath {

namespace {

/// Logs publishers of another type: subscribers accept only one type, and roscpp does not report it
/// to publishers.
void report_other_type(const std::string& topic, const std::string& type) {
  ros::master::V_TopicInfo published;
  ros::master::getTopics(published);
  for (const ros::master::TopicInfo& other : published) {
    if (other.name != topic || other.datatype == type || other.datatype == "*") continue;
    ROS_ERROR_STREAM("another node publishes "
                     << topic << " as " << other.datatype << ", but the bridge as " << type
                     << "; subscribers reject one of them: start the bridge in another "
                        "namespace (__ns:=NAME)");
  }
}

}  // namespace

template <class Output>
struct RosPublisher<Output>::Impl {
  ros::NodeHandle node;
  ros::Publisher publisher;
};

template <class Output>
RosPublisher<Output>::RosPublisher(const std::string& topic, const Options& options)
    : impl_(std::make_shared<Impl>()) {
  using Message = decltype(to_message(std::declval<Output>()));
  report_other_type(impl_->node.resolveName(topic), ros::message_traits::DataType<Message>::value());
  impl_->publisher = impl_->node.template advertise<Message>(topic, options.queue, options.latched);
}

template <class Output>
void RosPublisher<Output>::publish(const Output& output) const {
  if (impl_) impl_->publisher.publish(to_message(output));
}

template class RosPublisher<Scalar>;
template class RosPublisher<Text>;
template class RosPublisher<ByteArray>;
template class RosPublisher<ClockTime>;
template class RosPublisher<StampedVector>;
template class RosPublisher<MarkerSet>;
template class RosPublisher<Diagnoses>;
template class RosPublisher<PointCloud>;
template class RosPublisher<StaticTransforms>;

}  // namespace hotpath
