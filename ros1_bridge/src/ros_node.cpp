// SPDX-License-Identifier: Apache-2.0
#include "ros_node.hpp"

#include <ros/publication.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

#include "termination.hpp"

namespace hotpath {

namespace {

/// Returns false if the master is gone.
bool register_topics() {
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  for (const std::string& topic : topics) {
    const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
    XmlRpc::XmlRpcValue request, response, payload;
    request[0] = ros::this_node::getName();
    request[1] = topic;
    request[2] = publication ? publication->getDataType() : "";
    request[3] = ros::XMLRPCManager::instance()->getServerURI();
    if (!ros::master::execute("registerPublisher", request, response, payload, false)) return false;
  }
  return true;
}

}  // namespace

std::string registered_uri() {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = ros::this_node::getName();
  const bool known = ros::master::execute("lookupNode", request, response, uri, false);
  return known && uri.getType() == XmlRpc::XmlRpcValue::TypeString ? std::string(uri) : "";
}

Registration::Registration(const HostAndPort& master) : master_(master), thread_([this] { watch(); }) {}

Registration::~Registration() {
  ended_ = true;
  thread_.join();
}

void Registration::watch() {
  const std::string address = "http://" + master_.host + ":" + master_.port;
  for (bool there = true; !ended_ && !terminated(kMasterPoll);) {
    const bool was_there = there;
    there = accepts_connections(master_, kMasterTimeOut) && ros::master::check();
    if (!ros::ok()) return;
    if (!there && was_there) {
      ROS_WARN_STREAM("the ROS master at "
                      << address << " has gone; known subscribers go on, waiting for it to come back");
    }
    if (!there || registered_uri() == ros::XMLRPCManager::instance()->getServerURI()) continue;
    if (register_topics()) ROS_INFO_STREAM("registered all topics with the new ROS master at " << address);
  }
}

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

}  // namespace hotpath
