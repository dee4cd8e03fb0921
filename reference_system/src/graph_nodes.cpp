// SPDX-License-Identifier: Apache-2.0
// The nodes of a graph file: the short forms of the six types, and nodes of type `callbacks`.
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <set>

#include "graph_source.hpp"
#include "hotpath/core/csv.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace hotpath {

namespace {

using Values = std::vector<Duration>;

std::vector<Callback> expanded(const ReferenceNode& node) {
  const bool cyclic = node.type == NodeType::cyclic;
  Publication publication;
  if (cyclic || node.type == NodeType::fusion) {
    publication.rule = cyclic ? PublishRule::last_of : PublishRule::all_new;
    publication.of.resize(node.inputs.size());
    std::iota(publication.of.begin(), publication.of.end(), 0U);
  }
  std::vector<Callback> callbacks(node.inputs.size() + (cyclic || node.type == NodeType::sensor));
  for (std::uint32_t i = 0; i < callbacks.size(); ++i) {
    Callback& callback = callbacks[i];
    if (i < node.inputs.size()) {
      callback.task = node.name + "/" + node.inputs[i].topic;
      callback.input = i;
      callback.priority = node.inputs[i].priority;
      if (cyclic) continue;  // only stores
    } else {
      static_cast<StatedTimer&>(callback) = node;
      callback.task = node.name;
      if (callback.deadline == Duration::zero()) callback.deadline = callback.period;
    }
    callback.worst = node.execution_time;
    callback.best = node.best_case_execution_time;
    if (node.outputs.empty()) continue;
    publication.topic = node.outputs.at(node.type == NodeType::intersection ? i : 0);
    callback.publishes = {publication};
  }
  return callbacks;
}

void read_timer(const GraphMap& map, StatedTimer& timer) {
  map.read_all(graph_keys::kOfTimer, timer);
  if (!map.find("deadline_ms")) timer.deadline = timer.period;
  if (timer.release_jitter >= timer.period)
    map.find("release_jitter_ms")
        ->fail("the release jitter of " + map.what() + " is not below its period",
               "give less than the `period_ms`");
}

ReferenceInput read_input(const YamlValue& value, const std::string& node, std::uint32_t depth) {
  if (value.is_text()) return {{value.topic(), depth}, {}};
  const GraphMap map(value, "an input of " + node, KeysOf::input);
  map.check();
  ReferenceInput input{{"", depth}, {}};
  map.read("topic", input.topic);
  map.read("depth", input.depth);
  map.read("priority", input.priority);
  return input;
}

void read_execution_time(const GraphMap& map, const std::string& subject, ReferenceNode& node) {
  map.read("execution_time_ms", node.execution_time);
  node.best_case_execution_time = node.execution_time;
  map.read("best_case_execution_time_ms", node.best_case_execution_time);
  if (node.best_case_execution_time > node.execution_time)
    map.find("best_case_execution_time_ms")
        ->fail("the best case of " + subject + " is longer than its execution time",
               "give a `best_case_execution_time_ms` of at most `execution_time_ms`");
}

/// The values of `input` or `inputs`.
std::vector<YamlValue> inputs_of(const GraphMap& map, const std::string& subject, NodeType type) {
  const auto one = map.find("input"), many = map.find("inputs");
  if (one && many)
    map.fail(subject + " has both `input` and `inputs`", "keep `inputs` for a list, `input` for one");
  std::vector<YamlValue> values;
  if (one) values.push_back(*one);
  if (many) values = many->list("an input of " + subject);
  const std::size_t count = values.size();
  const std::string problem = subject + " has " + std::to_string(count) + (count == 1 ? " input" : " inputs");
  const bool cyclic = type == NodeType::cyclic, fusion = type == NodeType::fusion;
  if (cyclic && count == 0)
    map.fail(subject + " has no input",
             "a cyclic node stores messages of one input or more; without any it is a sensor");
  if (fusion && count < 2) map.fail(problem, "a fusion needs two or more; with one it is a transform");
  if (!cyclic && !fusion && count != 1)
    map.fail(problem, "a " + std::string(to_string(type)) + " has exactly one");
  return values;
}

/// A node of one of the six types. `subject` names it in messages.
Node read_short_form(const GraphMap& map, const std::string& subject, NodeType type, NodeLines& lines) {
  ReferenceNode node;
  node.name = map.needed("name").name();
  node.type = type;
  if (type == NodeType::sensor || type == NodeType::cyclic) read_timer(map, node);
  read_execution_time(map, subject, node);
  map.read("callback_group", node.group);
  const auto add_input = [&](const YamlValue& value) {
    node.inputs.push_back(read_input(value, subject, default_depth(type)));
    lines.inputs.push_back(value.line());
  };
  const auto add_output = [&](const std::string& topic, int line) {
    node.outputs.push_back(topic);
    lines.outputs.push_back(line);
  };
  if (type == NodeType::intersection) {
    for (const YamlValue& value : map.needed("connections").list("a connection of " + subject)) {
      const GraphMap connection(value, "a connection of " + subject, KeysOf::connection);
      connection.check();
      const YamlValue input = connection.needed("input"), output = connection.needed("output");
      add_input(input);
      add_output(output.topic(), output.line());
    }
    return node;
  }
  if (type != NodeType::sensor) std::ranges::for_each(inputs_of(map, subject, type), add_input);
  if (type == NodeType::command) return node;
  std::string topic = node.name;
  const bool named = map.read("output", topic);
  add_output(topic, named ? map.find("output")->line() : lines.node);
  return node;
}

/// Reads the column execution_time_ms of a CSV file.
Values read_values(const std::filesystem::path& path) {
  CsvReader rows(path, CsvLayout::by_hand);
  const std::size_t column = rows.column("execution_time_ms");
  Values values;
  while (rows.next()) {
    const std::optional<Duration> value = parse_ms(rows.text(column));
    if (!value || *value < Duration::zero()) {
      rows.fail("an execution time is `" + std::string(rows.text(column)) + "`",
                "give 0 or more decimal milliseconds such as 4.2");
    }
    values.push_back(*value);
  }
  if (values.empty())
    rows.fail("the file has no execution time", "add a line for each measured execution time");
  return values;
}

/// `min` and `max` without other quantiles are a range.
void read_quantiles(const GraphMap& map, Callback& callback) {
  std::vector<DurationQuantile> quantiles;
  std::string previous;
  (void)map.needed("min");
  (void)map.needed("max");
  for (const auto& [key, percent] : graph_keys::kOfExecutionTime) {
    DurationQuantile quantile{percent, {}};
    if (!map.read(key, quantile.time)) continue;
    if (!quantiles.empty() && quantile.time < quantiles.back().time)
      map.fail(map.what() + " has a `" + previous + "` above its `" + key + "`", "swap them");
    quantiles.push_back(quantile);
    previous = key;
  }
  callback.best = quantiles.front().time;
  callback.worst = quantiles.back().time;
  if (quantiles.size() == 2) return;
  callback.measured = std::make_shared<const Values>(values_of(quantiles));
  callback.quantiles = std::move(quantiles);
}

/// `folder`: of the graph.
void read_execution_time(const YamlValue& value, const std::filesystem::path& folder, Callback& callback) {
  if (value.is_text()) {
    callback.worst = callback.best = value.milliseconds(true);
    return;
  }
  const GraphMap map(value, "the execution time of " + callback.task, KeysOf::execution_time);
  map.check();
  const auto measured = map.find("measured"), file = map.find("file");
  if (!measured && !file) return read_quantiles(map, callback);
  if (map.keys().size() > 1)
    map.fail(map.what() + " is given in two ways", "keep one of `min` with `max`, `measured` and `file`");
  Values values;
  if (measured) {
    for (const YamlValue& v : measured->list("a value of " + map.what()))
      values.push_back(v.milliseconds(true));
  } else {
    callback.measured_file = file->text();
    values = read_values(folder / callback.measured_file);
  }
  const auto [least, most] = std::ranges::minmax(values);
  callback.best = least;
  callback.worst = most;
  callback.measured = std::make_shared<const Values>(std::move(values));
}

/// Groups, callbacks, inputs and outputs of a node of type `callbacks`.
class LongForm {
 public:
  LongForm(const GraphMap& map, const std::filesystem::path& folder, Node& node, NodeLines& lines)
      : map_(map), folder_(folder), node_(node), lines_(lines) {}

  void read() {
    if (const auto given = map_.find("groups")) {
      const YamlMap groups(*given, "`groups` of " + what_);
      node_.group_names = groups.keys();
      for (const std::string& group : node_.group_names)
        node_.groups.push_back(groups.find(group)->choice<CallbackGroup>());
    }
    std::vector<GraphMap> maps;
    for (const YamlValue& value : map_.needed("callbacks").list("a callback of " + what_)) {
      maps.emplace_back(value, "a callback of " + what_, KeysOf::timer);
      read_callback(maps.back());
    }
    // Read last, because `publishes` may name any input.
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (const auto given = maps[i].find("publishes")) read_publishes(*given, node_.callbacks[i]);
    }
  }

 private:
  void read_callback(GraphMap& map) {
    const auto timer = map.find("timer"), subscription = map.find("subscription");
    if (!timer == !subscription) {
      map.fail(
          map.what() + (timer ? " is both a timer and a subscription" : " is neither timer nor subscription"),
          "give it one of `timer: NAME` and `subscription: TOPIC`");
    }
    Callback callback;
    const std::string name = timer ? timer->long_name() : subscription->topic();
    callback.task = node_.name + "/" + name;
    map.set_what((timer ? "timer " : "subscription ") + callback.task);
    map.check_as(timer ? KeysOf::timer : KeysOf::subscription, graph_keys::kCallbacks);
    if (std::ranges::count(node_.callbacks, callback.task, &Callback::task) > 0)
      map.fail("there are two callbacks with the name " + callback.task,
               "name each timer differently, and subscribe to each topic once");
    if (timer) {
      read_timer(map, callback);
    } else {
      callback.input = static_cast<std::uint32_t>(node_.inputs.size());
      node_.inputs.push_back({name});
      map.read("depth", node_.inputs.back().depth);
      read_entity(map, callback);
      map.read("priority", callback.priority);
      lines_.inputs.push_back(subscription->line());
    }
    if (const auto given = map.find("execution_time_ms")) read_execution_time(*given, folder_, callback);
    callback.group = group_of(map);
    node_.callbacks.push_back(std::move(callback));
  }

  static void read_entity(const GraphMap& map, Callback& callback) {
    for (const auto& [kind, word] : enum_texts(EntityKind{})) {
      bool given = false;
      if (kind == EntityKind::subscription || !map.read(word, given) || !given) continue;
      if (callback.entity != EntityKind::subscription) {
        map.fail(map.what() + " is a " + to_string(callback.entity) + " and a " + word, "keep one of them");
      }
      callback.entity = kind;
    }
  }

  std::uint32_t group_of(const GraphMap& map) {
    std::string name;
    if (map.read("group", name)) {
      const auto position = std::ranges::find(node_.group_names, name);
      if (position == node_.group_names.end()) {
        map.find("group")->fail(
            map.what() + " is in group " + name + ", which is not among `groups` of " + what_,
            node_.group_names.empty() ? "add `groups: {" + name + ": reentrant}` to the node"
                                      : suggest(name, node_.group_names));
      }
      return static_cast<std::uint32_t>(position - node_.group_names.begin());
    }
    // All other callbacks share one group, like in rclcpp's nodes.
    if (node_.groups.size() == node_.group_names.size())
      node_.groups.push_back(CallbackGroup::mutually_exclusive);
    return static_cast<std::uint32_t>(node_.group_names.size());
  }

  /// A topic, a rule, or a list of them.
  void read_publishes(const YamlValue& value, Callback& callback) {
    const std::string subject = "a publication of " + callback.task;
    for (const YamlValue& item : value.is_list() ? value.list(subject) : std::vector<YamlValue>{value}) {
      Publication publication;
      if (item.is_text()) {
        publication.topic = item.topic();
      } else {
        read_rule(GraphMap(item, subject, KeysOf::publication), publication);
      }
      if (std::ranges::count(callback.publishes, publication.topic, &Publication::topic) > 0)
        item.fail(callback.task + " publishes topic " + publication.topic + " twice",
                  "keep one of the rules");
      if (std::ranges::count(node_.outputs, publication.topic) == 0) {
        node_.outputs.push_back(publication.topic);
        lines_.outputs.push_back(item.line());
      }
      callback.publishes.push_back(std::move(publication));
    }
  }

  void read_rule(const GraphMap& map, Publication& publication) const {
    map.check();
    map.read("topic", publication.topic);
    map.read("at_percent", publication.at);
    map.read("first", publication.first);
    const auto when = map.find("when"), of = map.find("of"), last = map.find("last_of");
    const bool every = map.find("every").has_value();
    if (int(when.has_value()) + int(every) + int(last.has_value()) > 1)
      map.fail(map.what() + " has several rules", "keep one of `when`, `every` and `last_of`");
    if (when && when->choice({"always", "all_new"}) == 1) {
      publication.rule = PublishRule::all_new;
      publication.of = inputs_of(map.require("of", "[TOPIC, TOPIC]"), map.what());
    } else if (of) {
      of->fail("`of` of " + map.what() + " needs the rule all_new", "add `when: all_new`, or remove `of`");
    } else if (every) {
      publication.rule = PublishRule::every;
      map.read("every", publication.n);
    } else if (last) {
      publication.rule = PublishRule::last_of;
      publication.of = inputs_of(*last, map.what());
    }
    if (publication.first > (every ? publication.n : 0))
      map.fail("`first` of " + map.what() + " needs an `every` that is not smaller", "change or remove it");
  }

  /// Ascending indices into the node's inputs.
  std::vector<std::uint32_t> inputs_of(const YamlValue& value, const std::string& subject) const {
    std::vector<std::string> topics;
    for (const Input& input : node_.inputs) topics.push_back(input.topic);
    std::set<std::uint32_t> inputs;
    for (const YamlValue& item : value.list("an input of " + subject)) {
      const std::string topic = item.topic();
      const auto position = std::ranges::find(topics, topic);
      if (position == topics.end()) {
        // NOLINTNEXTLINE(performance-inefficient-string-concatenation): it ends the loop
        item.fail(subject + " waits for topic " + topic + ", to which " + what_ + " does not subscribe",
                  suggest(topic, topics));
      }
      const bool is_new = inputs.insert(static_cast<std::uint32_t>(position - topics.begin())).second;
      // NOLINTNEXTLINE(performance-inefficient-string-concatenation): it ends the loop
      if (!is_new) item.fail(subject + " names topic " + topic + " twice", "name each input once");
    }
    return {inputs.begin(), inputs.end()};
  }

  const GraphMap& map_;
  const std::filesystem::path folder_;
  Node& node_;
  NodeLines& lines_;
  const std::string what_ = "node " + node_.name;
};

}  // namespace

ReferenceNode::operator Node() const {
  return {name, type, {inputs.begin(), inputs.end()}, outputs, {group}, {}, expanded(*this)};
}

void read_node(const YamlValue& value, GraphSource& source) {
  GraphMap map(value, "a node", static_cast<KeysOf>(NodeType::callbacks));
  Node& node = source.graph.nodes.emplace_back();
  NodeLines& lines = source.nodes.emplace_back();
  lines.node = map.line();
  node.name = map.needed("name").long_name();
  const std::string subject = "node " + node.name;
  map.set_what(subject);
  map.read("type", node.type);
  map.set_what(to_string(node.type) + (" " + node.name));
  map.check_as(static_cast<KeysOf>(node.type), graph_keys::kNodes);
  if (node.type == NodeType::callbacks) {
    LongForm(map, source.folder, node, lines).read();
  } else {
    node = read_short_form(map, subject, node.type, lines);
  }
}

}  // namespace hotpath
