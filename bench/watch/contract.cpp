// SPDX-License-Identifier: Apache-2.0
#include "watch/contract.hpp"

#include <set>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

constexpr const char* kRemedy = "a contract has the key `callbacks`, a list; see docs/watch.md";
constexpr std::int64_t kMostTimers = 1000, kMostDepth = 1'000'000;

class ContractReader {
 public:
  explicit ContractReader(const std::string& file) : file_(file) {}

  Contract read() {
    YamlMap map(YamlValue(file_, read_yaml(file_, read_text_file(file_), kRemedy), "the contract", 1),
                "the contract");
    map.check_keys({"callbacks"});
    Contract contract;
    std::set<std::string> names;
    for (const YamlValue& item :
         map.require("callbacks", "[{node: NAME, budget_ms: {value: 5, from: given}}]").list("a callback")) {
      const CallbackContract& added = contract.callbacks.emplace_back(read_callback(item));
      if (!names.insert(added.name()).second)
        item.fail("it is the second entry for " + added.name(), "put all its terms into one entry");
    }
    return contract;
  }

 private:
  static CallbackContract read_callback(const YamlValue& item) {
    YamlMap map(item, "a callback");
    CallbackContract callback;
    callback.node = map.require("node", "NAME").long_name();
    map.set_what("the callback of node " + callback.node);
    const bool subscription = map.find("topic").has_value();
    std::vector<std::string> keys = {"node", "budget_ms", "response_ms"}, others = {"timer", "period_ms"};
    std::vector<std::string> of_subscriptions = {"topic", "minimum_distance_ms", "depth"};
    if (subscription) std::swap(others, of_subscriptions);
    keys.insert(keys.end(), others.begin(), others.end());
    map.check_keys(keys, of_subscriptions);
    if (subscription) callback.topic = map.find("topic")->topic();
    if (const auto timer = map.find("timer"))
      callback.timer = static_cast<std::uint32_t>(timer->integer(1, kMostTimers));
    for (const auto& [clause, key] : enum_texts(Clause{})) {
      if (const auto value = map.find(std::string(key))) callback.terms.push_back(read_term(*value, clause));
    }
    if (callback.terms.empty()) map.fail("it promises nothing", "add `budget_ms: {value: 5, from: given}`");
    return callback;
  }

  static Term read_term(const YamlValue& value, Clause clause) {
    YamlMap map(value, std::string(to_string(clause)));
    map.check_keys({"value", "from"});
    Term term{clause};
    const YamlValue limit = map.require("value", "5");
    term.limit = clause == Clause::depth ? limit.integer(1, kMostDepth)
                                         : limit.milliseconds(clause == Clause::minimum_distance).count();
    term.origin = map.require("from", "given").choice<Origin>();
    return term;
  }

  const std::string& file_;
};

}  // namespace

std::string CallbackContract::name() const {
  if (!topic.empty()) return node + "/" + topic;
  return timer == 1 ? node + " (timer)" : program::concat(node, " (timer ", timer, ")");
}

Contract read_contract(const std::string& file) { return ContractReader(file).read(); }

}  // namespace hotpath::watch
