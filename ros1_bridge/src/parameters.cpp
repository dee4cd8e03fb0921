// SPDX-License-Identifier: Apache-2.0
#include "parameters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "names.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

/// Reads parameters one by one and records their names, to detect unknown parameters.
class Reader {
 public:
  explicit Reader(const RosNode& node) : node_(node) {}

  void flag(const std::string& name, bool& value) {
    if (const auto given = node_.boolean(known(name))) value = *given;
  }

  template <class Integer>
  void whole(const std::string& name, Integer& value, std::int64_t first, std::int64_t last) {
    const auto given = node_.integer(known(name));
    if (!given) return;
    if (*given < first || *given > last) {
      refuse(name, std::to_string(*given), std::to_string(first) + " to " + std::to_string(last));
    }
    value = static_cast<Integer>(*given);
  }

  void limit(const std::string& name, Limit& limit) {
    for (auto [suffix, value] : {std::pair{"_warn", &limit.warn}, std::pair{"_error", &limit.error}}) {
      const auto given = node_.number(known(name + suffix));
      if (!given) continue;
      if (!(*given > 0)) refuse(name + suffix, decimals(*given, 3), "more than 0");
      *value = *given;
    }
  }

  void names(const std::string& name, std::vector<std::string>& value) {
    if (auto given = node_.strings(known(name))) value = std::move(*given);
  }

  void check_distinct(const std::string& name, const std::vector<std::string>& value) const {
    const std::set<std::string> distinct(value.begin(), value.end());
    if (distinct.size() != value.size()) refuse(name, joined(value), "names that differ");
  }

  void text(const std::string& name, std::string& value) {
    if (auto given = node_.string(known(name))) value = std::move(*given);
  }

  void report_unknown() const {
    std::vector<std::string> unknown;
    for (const std::string& name : node_.parameters()) {
      if (!known_.contains(name)) unknown.push_back("~" + name);
    }
    if (unknown.empty()) return;
    RosNode::log(RosNode::Severity::warning,
                 "ignored unknown parameters " + joined(unknown) + " (`rosparam delete " + node_.name() +
                     "` deletes all parameters); known are " + joined({known_.begin(), known_.end()}));
  }

 private:
  const std::string& known(const std::string& name) { return *known_.insert(name).first; }

  [[noreturn]] void refuse(const std::string& name, const std::string& value,
                           const std::string& right) const {
    throw ParameterError("parameter " + node_.name() + "/" + name + " is " + value + ", but must be " +
                         right);
  }

  const RosNode& node_;
  std::set<std::string> known_;
};

/// The default frame, prefixed with the node's namespace so that the frames of two bridges differ.
std::string default_frame(const RosNode& node) {
  const std::string space = node.name_space();
  return (space == "/" ? "" : space.substr(1) + "/") + "hotpath";
}

}  // namespace

Parameters read_parameters(const RosNode& node) {
  constexpr std::int64_t kMost = 1'000'000;
  Parameters p;
  p.frame = default_frame(node);
  std::size_t queue_mib = p.telemetry.queue_bytes >> 20;
  Reader read(node);
  read.whole("domain", p.telemetry.domain, 0, 232);
  read.flag("all_interfaces", p.telemetry.all_interfaces);
  read.names("chains", p.chains);
  read.names("bytes_topics", p.telemetry.bytes_topics);
  read.check_distinct("bytes_topics", p.telemetry.bytes_topics);
  read.flag("points", p.points);
  read.flag("clock", p.clock);
  read.text("frame", p.frame);
  read.whole("queue_size", p.telemetry.queue, 1, kMost);
  read.whole("queue_mib", queue_mib, 1, 65536);
  read.whole("ros_queue_size", p.ros_queue, 1, kMost);
  read.whole("bytes_ros_queue_size", p.bytes_ros_queue, 1, kMost);
  read.whole("graph_every", p.graph_every, 1, kMost);
  read.whole("points_every", p.points_every, 1, kMost);
  read.whole("diagnostics_every", p.diagnostics_every, 1, kMost);
  read.limit("skipped", p.limits.skipped);
  read.limit("overwritten", p.limits.overwritten);
  read.limit("overruns", p.limits.overruns);
  read.limit("queue", p.limits.queue);
  read.report_unknown();
  p.telemetry.queue_bytes = queue_mib << 20;
  return p;
}

}  // namespace hotpath
