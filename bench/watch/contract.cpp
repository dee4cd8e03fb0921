// SPDX-License-Identifier: Apache-2.0
#include "watch/contract.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath/reference_system/yaml_value.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

constexpr const char* kRemedy =
    "a contract has the keys `callbacks`, `chains` and `threads`, each a list; see docs/watch.md";
constexpr std::int64_t kMostTimers = 1000, kMostCount = 1'000'000;
constexpr std::size_t kMostDistances = 100;

class ContractReader {
 public:
  explicit ContractReader(const std::string& file) : file_(file) {}

  Contract read(const std::string& text) {
    YamlMap map(YamlValue(file_, read_yaml(file_, text, kRemedy), "the contract", 1), "the contract");
    map.check_keys({"callbacks", "chains", "threads"});
    for (const YamlValue& item :
         map.require("callbacks", "[{node: NAME, budget_ms: {value: 5, from: given}}]").list("a callback")) {
      contract_.callbacks.push_back(read_callback(item));
      check_new(item, contract_.callbacks.back().name());
    }
    if (const auto chains = map.find("chains"))
      for (const YamlValue& item : chains->items("a chain")) read_chain(item);
    if (const auto threads = map.find("threads"))
      for (const YamlValue& item : threads->items("threads")) read_thread(item);
    return std::move(contract_);
  }

 private:
  void check_new(const YamlValue& item, const std::string& name) {
    if (!names_.insert(name).second)
      item.fail("it is the second entry for " + name, "put all its terms into one entry");
  }

  static CallbackContract read_callback(const YamlValue& item) {
    YamlMap map(item, "a callback");
    CallbackContract callback;
    callback.node = map.require("node", "NAME").long_name();
    map.set_what("the callback of node " + callback.node);
    const auto topic = map.find("topic"), service = map.find("service");
    if (topic && service) map.fail("it has a topic and a service", "give each an entry of its own");
    callback.service = service.has_value();
    std::vector<std::string> keys = {"node", "budget_ms", "maximum_distance_ms", "publishes", "response_ms"},
                             others = {"timer", "period_ms"};
    std::vector<std::string> of_subscriptions = {"topic", "service", "minimum_distance_ms", "depth", "lost"};
    if (topic || service) std::swap(others, of_subscriptions);
    keys.insert(keys.end(), others.begin(), others.end());
    map.check_keys(keys, of_subscriptions);
    if (topic || service) callback.topic = (topic ? topic : service)->topic();
    if (const auto timer = map.find("timer"))
      callback.timer = static_cast<std::uint32_t>(timer->integer(1, kMostTimers));
    if (const auto publishes = map.find("publishes")) {
      callback.terms.push_back({Clause::publishes, 1});
      for (const YamlValue& p : publishes->items("a publication"))
        callback.publishes.push_back(read_publication(p));
    }
    read_terms(map, callback.terms);
    if (callback.terms.empty()) map.fail("it promises nothing", "add `budget_ms: {value: 5, from: given}`");
    return callback;
  }

  static StatedPublication read_publication(const YamlValue& item) {
    YamlMap map(item, "a publication");
    map.check_keys({"topic", "with"});
    StatedPublication publication{map.require("topic", "NAME").topic()};
    if (const auto with = map.find("with"))
      for (const YamlValue& topic : with->items("a topic")) publication.with.push_back(topic.topic());
    return publication;
  }

  static void read_terms(const YamlMap& map, std::vector<Term>& terms) {
    for (const ClauseTraits& clause : kClauses) {
      if (clause.unit == Unit::stated) continue;
      if (const auto value = map.find(clause.text)) terms.push_back(read_term(*value, clause.value));
    }
  }

  static Term read_term(const YamlValue& value, Clause clause) {
    YamlMap map(value, std::string(to_string(clause)));
    map.check_keys({"value", "from"});
    Term term{clause};
    read_limit(map.require("value", "5"), term);
    term.origin = map.require("from", "given").choice<Origin>();
    return term;
  }

  static void read_limit(const YamlValue& limit, Term& term) {
    const ClauseTraits& traits = traits_of(term.clause);
    if (term.clause == Clause::minimum_distance && limit.is_list()) return read_distances(limit, term);
    if (traits.unit == Unit::ms) term.limit = limit.milliseconds(traits.zero).count();
    if (traits.unit == Unit::count) term.limit = limit.integer(traits.zero ? 0 : 1, kMostCount);
    if (traits.unit == Unit::processors)
      for (const YamlValue& processor : limit.list("a processor"))
        term.processors.push_back(static_cast<int>(processor.integer(0, kMaxProcessor)));
    std::ranges::sort(term.processors);
    if (traits.unit != Unit::policy) return;
    try {
      term.policy = parse_thread_policy(limit.text());
    } catch (const std::invalid_argument& error) {
      limit.fail("the policy `" + limit.text() + "` is invalid", error.what());
    }
  }

  static void read_distances(const YamlValue& limit, Term& term) {
    for (const YamlValue& distance : limit.list("a distance"))
      term.further.push_back(distance.milliseconds(true).count());
    if (term.further.size() > kMostDistances)
      limit.fail(program::concat("it has ", term.further.size(), " distances"),
                 program::concat("give at most ", kMostDistances));
    if (!std::ranges::is_sorted(term.further))
      limit.fail("the distances do not ascend", "give those to the first, second, third next publication");
    term.limit = term.further.front();
    term.further.erase(term.further.begin());
  }

  void read_chain(const YamlValue& item) {
    YamlMap map(item, "a chain");
    ChainContract chain{map.require("name", "NAME").long_name()};
    map.set_what("the chain " + chain.name);
    map.check_keys({"name", "sources", "sinks", "hot_path_ms", "age_ms", "requirement_ms"});
    chain.sources = read_names(map, "sources");
    chain.sinks = read_names(map, "sinks");
    if (chain.sources.size() > kMaxSources)
      map.fail(program::concat(map.what(), " has ", chain.sources.size(), " sources"),
               program::concat("name at most ", kMaxSources));
    read_terms(map, chain.terms);
    check_new(item, "the chain " + chain.name);
    contract_.chains.push_back(std::move(chain));
  }

  void read_thread(const YamlValue& item) {
    YamlMap map(item, "threads");
    ThreadContract thread{map.require("name", "NAME").text()};
    map.set_what("the threads of " + thread.name);
    map.check_keys({"name", "callbacks", "policy", "processors", "wait_ms"});
    thread.callbacks = read_names(map, "callbacks");
    thread.terms.push_back({Clause::serves});
    read_terms(map, thread.terms);
    check_new(item, "the threads of " + thread.name);
    contract_.threads.push_back(std::move(thread));
  }

  /// Indices of callbacks by their names.
  std::vector<std::uint32_t> read_names(const YamlMap& map, const std::string& key) const {
    std::vector<std::uint32_t> indices;
    for (const YamlValue& name : map.require(key, "[NODE (timer), NODE/TOPIC]").list("a callback")) {
      const auto named = std::ranges::find(contract_.callbacks, name.text(), &CallbackContract::name);
      if (named == contract_.callbacks.end())
        name.fail("no callback is called `" + name.text() + "`",
                  "the names are those of the list `callbacks`, for example `" +
                      contract_.callbacks.front().name() + "`");
      indices.push_back(static_cast<std::uint32_t>(named - contract_.callbacks.begin()));
    }
    return indices;
  }

  const std::string& file_;
  Contract contract_;
  std::set<std::string> names_;
};

}  // namespace

std::string CallbackContract::name() const {
  if (!topic.empty()) return node + "/" + topic + (service ? " (service)" : "");
  return timer == 1 ? node + " (timer)" : program::concat(node, " (timer ", timer, ")");
}

Contract parse_contract(const std::string& file, const std::string& text) {
  return ContractReader(file).read(text);
}

Contract read_contract(const std::string& file) { return parse_contract(file, read_text_file(file)); }

}  // namespace hotpath::watch
