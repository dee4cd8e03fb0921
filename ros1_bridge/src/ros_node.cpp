// SPDX-License-Identifier: Apache-2.0
#include "ros_node.hpp"

#include <ros/publication.h>
#include <ros/ros.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

#include <cstdio>
#include <sstream>

namespace hotpath {

struct RosNode::Impl {
  ros::NodeHandle node{"~"};
  // Required for latched messages: they reach new subscribers through its queue.
  ros::AsyncSpinner spinner{1};
};

namespace {

/// The value of private `parameter`, or std::nullopt if unset. Throws ParameterError for another
/// type.
template <class Value>
std::optional<Value> typed(const ros::NodeHandle& node, const std::string& parameter, const char* expected) {
  if (!node.hasParam(parameter)) return std::nullopt;
  Value value{};
  if (!node.getParam(parameter, value)) {
    throw ParameterError("parameter " + node.resolveName(parameter) + " must be " + expected +
                         "; set it with `rosparam set` or in the launch file");
  }
  return value;
}

std::string data_type(const std::string& topic) {
  const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
  return publication ? publication->getDataType() : "";
}

std::vector<std::string> advertised() {
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  return topics;
}

}  // namespace

std::vector<std::string> without_ros_arguments(int argc, char** argv) {
  ros::V_string rest;
  ros::removeROSArgs(argc, argv, rest);
  return rest;
}

RosNode::RosNode(int& argc, char** argv, const std::string& name) {
  // Line buffering: otherwise rosconsole's output stays in a buffer if standard output is a file or
  // a pipe.
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
}

RosNode::~RosNode() {
  impl_.reset();
  ros::shutdown();
}

void RosNode::start() {
  impl_ = std::make_unique<Impl>();
  impl_->spinner.start();
}

std::string RosNode::name() const { return ros::this_node::getName(); }

std::string RosNode::name_space() const {
  // The environment or `__ns` may add a double slash. roscpp's clean() turns `/` into an empty
  // string.
  const std::string space = ros::names::clean(ros::this_node::getNamespace());
  return space.empty() ? "/" : space;
}

void RosNode::request_shutdown() { ros::requestShutdown(); }

bool RosNode::ok() { return ros::ok(); }

std::optional<bool> RosNode::boolean(const std::string& parameter) const {
  return typed<bool>(impl_->node, parameter, "true or false");
}

std::optional<double> RosNode::number(const std::string& parameter) const {
  return typed<double>(impl_->node, parameter, "a number");
}

std::optional<std::int64_t> RosNode::integer(const std::string& parameter) const {
  return typed<int>(impl_->node, parameter, "a whole number");
}

std::optional<std::string> RosNode::string(const std::string& parameter) const {
  return typed<std::string>(impl_->node, parameter, "a text");
}

std::optional<std::vector<std::string>> RosNode::strings(const std::string& parameter) const {
  std::string list;
  if (!impl_->node.getParam(parameter, list)) {
    return typed<std::vector<std::string>>(impl_->node, parameter,
                                           "a list of texts or a comma-separated text");
  }
  std::vector<std::string> result;
  std::istringstream in(list);
  for (std::string item; std::getline(in, item, ',');) {
    const auto first = item.find_first_not_of(' ');
    if (first != std::string::npos)
      result.push_back(item.substr(first, item.find_last_not_of(' ') + 1 - first));
  }
  return result;
}

std::vector<std::string> RosNode::parameters() const {
  std::vector<std::string> all, own;
  impl_->node.getParamNames(all);
  const std::string prefix = name() + "/";
  for (const std::string& parameter : all) {
    if (parameter.rfind(prefix, 0) == 0) own.push_back(parameter.substr(prefix.size()));
  }
  return own;
}

bool RosNode::uses_simulated_time() {
  bool simulated = false;
  return ros::param::get("/use_sim_time", simulated) && simulated;
}

std::string RosNode::namesake() const {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = name();
  request[1] = name();
  const bool known = ros::master::execute("lookupNode", request, response, uri, false);
  return known && uri.getType() == XmlRpc::XmlRpcValue::TypeString ? std::string(uri) : "";
}

RosNode::Registration RosNode::registration() const {
  if (!ros::master::check()) return Registration::no_master;
  return namesake() == ros::XMLRPCManager::instance()->getServerURI() ? Registration::registered
                                                                      : Registration::unknown;
}

bool RosNode::register_again() const {
  for (const std::string& topic : advertised()) {
    XmlRpc::XmlRpcValue request, response, payload;
    request[0] = name();
    request[1] = topic;
    request[2] = data_type(topic);
    request[3] = ros::XMLRPCManager::instance()->getServerURI();
    if (!ros::master::execute("registerPublisher", request, response, payload, false)) return false;
  }
  return true;
}

void RosNode::log(Severity severity, const std::string& text) {
  switch (severity) {
    case Severity::info:
      ROS_INFO_STREAM(text);
      return;
    case Severity::warning:
      ROS_WARN_STREAM(text);
      return;
    case Severity::error:
      ROS_ERROR_STREAM(text);
  }
}

}  // namespace hotpath
