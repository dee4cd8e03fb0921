// SPDX-License-Identifier: Apache-2.0
#include "watch/contract.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

constexpr const char* kRemedy =
    "a contract has the keys `callbacks`, `chains` and `threads`, each a list; see docs/contract.md";
constexpr std::int64_t kMostTimers = 1000, kMostCount = 1'000'000;
constexpr std::size_t kMostDistances = 100;

/// The keys and words of a list of groups.
struct GroupKind {
  Kind of;
  const char *key, *item, *what, *callbacks;
  std::vector<Group> Contract::*groups;
};
constexpr GroupKind kGroups[] = {
    {Kind::chain, "chains", "a chain", "the chain ", "sources", &Contract::chains},
    {Kind::thread, "threads", "threads", "the threads of ", "callbacks", &Contract::threads}};

/// Whether the file states the term by its own key.
bool has_key(const ClauseTraits& clause) {
  return clause.unit != Unit::stated || clause.value == Clause::publishes;
}

std::vector<std::string> keys(Kind of, Holders holders, std::vector<std::string> keys) {
  for (const ClauseTraits& clause : kClauses)
    if (clause.of == of && has_key(clause) && clause.holders == holders) keys.emplace_back(clause.text);
  return keys;
}

void read_distances(const YamlValue& limit, Term& term) {
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

void read_limit(const YamlValue& limit, Term& term) {
  const ClauseTraits& traits = traits_of(term.clause);
  if (term.clause == Clause::minimum_distance && limit.is_list()) return read_distances(limit, term);
  if (traits.unit == Unit::ms) term.limit = limit.milliseconds(traits.zero).count();
  if (traits.unit == Unit::count) term.limit = limit.integer(traits.zero ? 0 : 1, kMostCount);
  if (traits.unit == Unit::processors) term.processors = read_processors(limit, "a processor");
  std::ranges::sort(term.processors);
  if (traits.unit != Unit::policy) return;
  try {
    term.policy = parse_thread_policy(limit.text());
  } catch (const std::invalid_argument& error) {
    limit.fail("the policy `" + limit.text() + "` is invalid", error.what());
  }
}

std::vector<Term> read_terms(const YamlMap& map, Kind of) {
  std::vector<Term> terms;
  for (const ClauseTraits& clause : kClauses) {
    const auto value = map.find(clause.text);
    if (clause.of != of || (has_key(clause) && !value)) continue;
    Term& term = terms.emplace_back(Term{clause.value});
    if (clause.unit == Unit::stated) continue;
    YamlMap fields(*value, clause.text);
    fields.check_keys({"value", "from"});
    read_limit(fields.require("value", "5"), term);
    term.origin = fields.require("from", "given").choice<Origin>();
  }
  return terms;
}

StatedPublication read_publication(const YamlValue& item) {
  YamlMap map(item, "a publication");
  map.check_keys({"topic", "with", "several"});
  StatedPublication publication{map.require("topic", "NAME").topic()};
  if (const auto several = map.find("several")) publication.several = several->choice({"false", "true"}) == 1;
  if (const auto with = map.find("with"))
    for (const YamlValue& topic : with->items("a topic")) publication.with.push_back(topic.topic());
  return publication;
}

CallbackContract read_callback(const YamlValue& item) {
  YamlMap map(item, "a callback");
  CallbackContract callback;
  callback.node = map.require("node", "NAME").long_name();
  map.set_what("the callback of node " + callback.node);
  const auto topic = map.find("topic"), service = map.find("service");
  if (topic && service) map.fail("it has a topic and a service", "give each an entry of its own");
  callback.service = service.has_value();
  std::vector<std::string> own = keys(Kind::callback, Holders::timers, {"timer"}),
                           other = keys(Kind::callback, Holders::subscriptions, {"topic", "service"});
  if (topic || service) std::swap(own, other);
  std::vector<std::string> known = keys(Kind::callback, Holders::all, {"node"});
  known.insert(known.end(), own.begin(), own.end());
  map.check_keys(known, other);
  if (topic || service) callback.topic = (topic ? topic : service)->topic();
  if (const auto timer = map.find("timer"))
    callback.timer = static_cast<std::uint32_t>(timer->integer(1, kMostTimers));
  if (const auto publishes = map.find(to_string(Clause::publishes)))
    for (const YamlValue& p : publishes->items("a publication"))
      callback.publishes.push_back(read_publication(p));
  callback.terms = read_terms(map, Kind::callback);
  if (callback.terms.empty()) map.fail("it promises nothing", "add `budget_ms: {value: 5, from: given}`");
  return callback;
}

/// Indices of callbacks by their names.
std::vector<std::uint32_t> read_names(const YamlMap& map, const char* key, const Contract& contract) {
  std::vector<std::uint32_t> indices;
  for (const YamlValue& name : map.require(key, "[NODE (timer), NODE/TOPIC]").list("a callback")) {
    const auto named = std::ranges::find(contract.callbacks, name.text(), &CallbackContract::name);
    if (named == contract.callbacks.end())
      name.fail("no callback is called `" + name.text() + "`",
                "the names are those of the list `callbacks`, for example `" +
                    contract.callbacks.front().name() + "`");
    indices.push_back(static_cast<std::uint32_t>(named - contract.callbacks.begin()));
  }
  return indices;
}

Group read_group(const YamlValue& item, const GroupKind& kind, const Contract& contract) {
  const bool chain = kind.of == Kind::chain;
  YamlMap map(item, kind.item);
  const YamlValue name = map.require("name", "NAME");
  Group group{chain ? name.long_name() : name.text()};
  map.set_what(kind.what + group.name);
  std::vector<std::string> known = {"name", kind.callbacks};
  if (chain) known.emplace_back("sinks");
  map.check_keys(keys(kind.of, Holders::all, known));
  group.callbacks = read_names(map, kind.callbacks, contract);
  if (chain) group.sinks = read_names(map, "sinks", contract);
  if (chain && group.callbacks.size() > kMaxSources)
    map.fail(program::concat(map.what(), " has ", group.callbacks.size(), " sources"),
             program::concat("name at most ", kMaxSources));
  group.terms = read_terms(map, kind.of);
  return group;
}

/// Lists and maps of terms are on one line.
YAML::Node flow(YAML::NodeType::value type) {
  YAML::Node node(type);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node limit_of(const Term& term) {
  const Unit unit = traits_of(term.clause).unit;
  if (unit == Unit::policy) return YAML::Node(to_string(term.policy));
  if (unit == Unit::processors) return YAML::Node(term.processors);
  if (unit == Unit::count) return YAML::Node(term.limit);
  if (term.further.empty()) return YAML::Node(format_ms(Duration(term.limit)));
  YAML::Node distances;
  distances.push_back(format_ms(Duration(term.limit)));
  for (const std::int64_t distance : term.further) distances.push_back(format_ms(Duration(distance)));
  return distances;
}

YAML::Node node_of(const std::vector<StatedPublication>& publishes) {
  YAML::Node all = flow(YAML::NodeType::Sequence);
  for (const StatedPublication& p : publishes) {
    YAML::Node publication;
    publication["topic"] = p.topic;
    for (const std::string& topic : p.with) publication["with"].push_back(topic);
    if (p.several) publication["several"] = true;
    all.push_back(publication);
  }
  return all;
}

void write_terms(const std::vector<Term>& terms, YAML::Node& subject,
                 const std::vector<StatedPublication>& publishes = {}) {
  for (const Term& term : terms) {
    if (!has_key(traits_of(term.clause))) continue;
    YAML::Node stated = flow(YAML::NodeType::Map);
    stated["value"] = limit_of(term);
    stated["from"] = to_string(term.origin);
    subject[to_string(term.clause)] = term.clause == Clause::publishes ? node_of(publishes) : stated;
  }
}

YAML::Node names_of(const std::vector<std::uint32_t>& callbacks, const Contract& contract) {
  YAML::Node names = flow(YAML::NodeType::Sequence);
  for (const std::uint32_t callback : callbacks) names.push_back(contract.callbacks[callback].name());
  return names;
}

}  // namespace

std::string CallbackContract::name() const {
  if (!topic.empty()) return node + "/" + topic + (service ? " (service)" : "");
  return timer == 1 ? node + " (timer)" : program::concat(node, " (timer ", timer, ")");
}

const StatedPublication* CallbackContract::publication(const std::string& published) const {
  const auto publication = std::ranges::find(publishes, published, &StatedPublication::topic);
  return publication == publishes.end() ? nullptr : &*publication;
}

const Term* find(const std::vector<Term>& terms, Clause clause) {
  const auto term = std::ranges::find(terms, clause, &Term::clause);
  return term == terms.end() ? nullptr : &*term;
}

Contract parse_contract(const std::string& file, const std::string& text) {
  YamlMap map(file, text, "the contract", kRemedy);
  map.check_keys({"callbacks", "chains", "threads", "rests_on", "assumed"});
  Contract contract;
  if (const auto given = map.find("rests_on")) contract.rests_on = given->text();
  if (const auto given = map.find("assumed")) contract.assumed = given->text();
  std::set<std::string> names;
  const auto check_new = [&](const YamlValue& item, const std::string& name) {
    if (!names.insert(name).second)
      item.fail("it is the second entry for " + name, "put all its terms into one entry");
  };
  for (const YamlValue& item :
       map.require("callbacks", "[{node: NAME, budget_ms: {value: 5, from: given}}]").list("a callback")) {
    contract.callbacks.push_back(read_callback(item));
    check_new(item, contract.callbacks.back().name());
  }
  for (const GroupKind& kind : kGroups) {
    const auto given = map.find(kind.key);
    if (!given) continue;
    for (const YamlValue& group : given->items(kind.item)) {
      std::vector<Group>& groups = contract.*kind.groups;
      groups.push_back(read_group(group, kind, contract));
      check_new(group, kind.what + groups.back().name);
    }
  }
  return contract;
}

Contract read_contract(const std::string& file) { return parse_contract(file, read_text_file(file)); }

std::string contract_text(const Contract& contract) {
  YAML::Node file;
  if (!contract.rests_on.empty()) file["rests_on"] = contract.rests_on;
  if (!contract.assumed.empty()) file["assumed"] = contract.assumed;
  for (const CallbackContract& callback : contract.callbacks) {
    YAML::Node stated;
    stated["node"] = callback.node;
    if (!callback.topic.empty()) stated[callback.service ? "service" : "topic"] = callback.topic;
    if (callback.timer > 1) stated["timer"] = callback.timer;
    write_terms(callback.terms, stated, callback.publishes);
    file["callbacks"].push_back(stated);
  }
  for (const GroupKind& kind : kGroups) {
    if (kind.of == Kind::thread) file[kind.key] = YAML::Node(YAML::NodeType::Sequence);
    for (const Group& group : contract.*kind.groups) {
      YAML::Node stated;
      stated["name"] = group.name;
      stated[kind.callbacks] = names_of(group.callbacks, contract);
      if (kind.of == Kind::chain) stated["sinks"] = names_of(group.sinks, contract);
      write_terms(group.terms, stated);
      file[kind.key].push_back(stated);
    }
  }
  return YAML::Dump(file) + "\n";
}

}  // namespace hotpath::watch
