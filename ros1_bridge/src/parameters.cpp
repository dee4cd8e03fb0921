// SPDX-License-Identifier: Apache-2.0
#include "parameters.hpp"

#include <set>
#include <stdexcept>

#include "text.hpp"

namespace hotpath {

namespace {

using XmlRpc::XmlRpcValue;

/// Reads parameters one by one and records their names, to detect unknown parameters.
class Reader {
 public:
  Reader(const XmlRpcValue& given, const std::string& node) : given_(given), node_(node) {}

  void flag(const std::string& name, bool& value) {
    if (XmlRpcValue* given = find(name, XmlRpcValue::TypeBoolean, "true or false"))
      value = static_cast<bool&>(*given);
  }

  void text(const std::string& name, std::string& value) {
    if (XmlRpcValue* given = find(name, XmlRpcValue::TypeString, "a text"))
      value = static_cast<std::string&>(*given);
  }

  void whole(const std::string& name, std::uint32_t& value, int first, int last) {
    const std::string right = "a whole number, " + std::to_string(first) + " to " + std::to_string(last);
    XmlRpcValue* const given = find(name, XmlRpcValue::TypeInt, right);
    if (given == nullptr) return;
    const int number = static_cast<int&>(*given);
    if (number < first || number > last) refuse(name, right);
    value = static_cast<std::uint32_t>(number);
  }

  std::string unknown() {
    std::vector<std::string> names;
    if (given_.getType() == XmlRpcValue::TypeStruct) {
      for (const auto& [name, value] : given_) {
        if (known_.count(name) == 0) names.push_back("~" + name);
      }
    }
    if (names.empty()) return "";
    return "ignored unknown parameters " + printable(joined(names), kMostOfList) + " (`rosparam delete " +
           node_ + "` deletes all parameters); known are " + joined({known_.begin(), known_.end()});
  }

 private:
  /// nullptr if the parameter is not set.
  XmlRpcValue* find(const std::string& name, XmlRpcValue::Type type, const std::string& right) {
    known_.insert(name);
    if (!given_.hasMember(name)) return nullptr;
    if (given_[name].getType() != type) refuse(name, right);
    return &given_[name];
  }

  [[noreturn]] void refuse(const std::string& name, const std::string& right) const {
    throw std::invalid_argument("parameter " + node_ + "/" + name + " must be " + right +
                                "; set it with `rosparam set` or in the launch file");
  }

  XmlRpcValue given_;
  const std::string node_;
  std::set<std::string> known_;
};

}  // namespace

Parameters read_parameters(XmlRpcValue given, const std::string& node, std::string& unknown) {
  Parameters p;
  // With the node's namespace, so that the frames of two bridges differ.
  p.frame = node.substr(1, node.rfind('/')) + "hotpath";
  Reader read(given, node);
  read.whole("domain", p.telemetry.domain, 0, 232);
  read.flag("all_interfaces", p.telemetry.all_interfaces);
  read.flag("points", p.points);
  read.flag("clock", p.clock);
  read.text("frame", p.frame);
  unknown = read.unknown();
  return p;
}

}  // namespace hotpath
