// SPDX-License-Identifier: Apache-2.0
#include "graph_callbacks.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/graph_text.hpp"

namespace hotpath {

namespace {

using Words = std::vector<std::string>;
using Values = std::vector<Duration>;

const Words kTimerKeys = {"timer",    "period_ms",         "phase_ms", "deadline_ms", "release_jitter_ms",
                          "priority", "execution_time_ms", "group",    "publishes"};
const Words kSubscriptionKeys = {"subscription",      "depth", "service",  "priority",
                                 "execution_time_ms", "group", "publishes"};
const std::string kColumn = "execution_time_ms";

/// Reads the column execution_time_ms of a CSV file.
Values read_values(const std::filesystem::path& path) {
  CsvReader rows(path, CsvLayout::by_hand);
  const std::size_t column = rows.column(kColumn);
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

class CallbackParser {
 public:
  CallbackParser(const YamlMap& map, const std::string& file, Node& node, NodeLines& lines)
      : map_(map), file_(file), node_(node), lines_(lines) {}

  void parse() {
    if (const auto given = map_.find("groups")) parse_groups(*given);
    std::vector<YamlMap> maps;
    const YamlValue list = map_.require("callbacks", "[{timer: NAME, period_ms: 100}]");
    for (const YamlValue& value : list.list("a callback of " + what_)) {
      maps.emplace_back(value, "a callback of " + what_);
      parse_callback(maps.back());
    }
    // Parsed last, because `publishes` may name any input.
    for (std::size_t i = 0; i < maps.size(); ++i) {
      if (const auto given = maps[i].find("publishes")) parse_publishes(*given, node_.callbacks[i]);
    }
  }

 private:
  void parse_groups(const YamlValue& value) {
    const YamlMap groups(value, "`groups` of " + what_);
    node_.group_names = groups.keys();
    for (const YamlValue& kind : groups.values()) node_.groups.push_back(kind.choice<CallbackGroup>());
  }

  void parse_callback(YamlMap& map) {
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
    map.check_keys(timer ? kTimerKeys : kSubscriptionKeys, timer ? kSubscriptionKeys : kTimerKeys);
    const auto same = [&](const Callback& other) { return other.task == callback.task; };
    if (std::any_of(node_.callbacks.begin(), node_.callbacks.end(), same)) {
      map.fail("there are two callbacks with the name " + callback.task,
               "name each timer differently, and subscribe to each topic once");
    }
    if (timer) {
      parse_timer(map, callback);
    } else {
      callback.input = static_cast<std::uint32_t>(node_.inputs.size());
      Input& input = node_.inputs.emplace_back();
      input.topic = name;
      if (const auto given = map.find("depth")) {
        input.depth = static_cast<std::uint32_t>(given->integer(1, kMaxDepth));
      }
      if (const auto given = map.find("service")) callback.service = given->choice({"false", "true"}) == 1;
      lines_.inputs.push_back(subscription->line());
    }
    if (const auto given = map.find("priority")) callback.priority = given->priority();
    if (const auto given = map.find("execution_time_ms")) parse_execution_time(*given, callback);
    callback.group = group_of(map);
    node_.callbacks.push_back(std::move(callback));
  }

  static void parse_timer(const YamlMap& map, Callback& callback) {
    callback.period = map.require("period_ms", "100").milliseconds(false);
    callback.deadline = callback.period;
    if (const auto given = map.find("phase_ms")) callback.phase = given->milliseconds(true);
    if (const auto given = map.find("deadline_ms")) callback.deadline = given->milliseconds(false);
    callback.release_jitter = parse_release_jitter(map, callback.period);
  }

  void parse_execution_time(const YamlValue& value, Callback& callback) const {
    if (value.is_text()) {
      callback.worst = callback.best = value.milliseconds(true);
      return;
    }
    const YamlMap map(value, "the execution time of " + callback.task);
    map.check_keys({"min", "p50", "p95", "p99", "max", "measured", "file"});
    const auto measured = map.find("measured"), file = map.find("file");
    if (!measured && !file) return parse_quantiles(map, callback);
    if (map.keys().size() > 1) {
      map.fail(map.what() + " is given in two ways", "keep one of `min` with `max`, `measured` and `file`");
    }
    Values values;
    if (measured) {
      for (const YamlValue& v : measured->list("a value of " + map.what()))
        values.push_back(v.milliseconds(true));
    } else {
      callback.measured_file = file->text();
      values = read_values(std::filesystem::path(file_).parent_path() / callback.measured_file);
    }
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    callback.best = *least;
    callback.worst = *most;
    callback.measured = std::make_shared<const Values>(std::move(values));
  }

  /// `min` and `max` without other quantiles are a range.
  static void parse_quantiles(const YamlMap& map, Callback& callback) {
    constexpr std::array<std::pair<const char*, double>, 5> kQuantiles = {
        {{"min", 0}, {"p50", 50}, {"p95", 95}, {"p99", 99}, {"max", 100}}};
    std::vector<DurationQuantile> quantiles;
    std::string previous;
    (void)map.require("min", "1.5");
    (void)map.require("max", "4.2");
    for (const auto& [key, percent] : kQuantiles) {
      const auto given = map.find(key);
      if (!given) continue;
      const Duration time = given->milliseconds(true);
      if (!quantiles.empty() && time < quantiles.back().time) {
        map.fail(map.what() + " has a `" + previous + "` above its `" + key + "`", "swap them");
      }
      quantiles.push_back({percent, time});
      previous = key;
    }
    callback.best = quantiles.front().time;
    callback.worst = quantiles.back().time;
    if (quantiles.size() == 2) return;
    callback.measured = std::make_shared<const Values>(values_of(quantiles));
    callback.quantiles = std::move(quantiles);
  }

  std::uint32_t group_of(const YamlMap& map) {
    if (const auto given = map.find("group")) {
      const std::string name = given->text();
      const auto position = std::find(node_.group_names.begin(), node_.group_names.end(), name);
      if (position == node_.group_names.end()) {
        given->fail(map.what() + " is in group " + name + ", which is not among `groups` of " + what_,
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

  void parse_publishes(const YamlValue& value, Callback& callback) {
    std::vector<YamlValue> items = {value};
    if (value.is_list()) items = value.list("a publication of " + callback.task);
    for (const YamlValue& item : items) {
      Publication publication;
      if (item.is_text()) {
        publication.topic = item.topic();
      } else {
        parse_rule(YamlMap(item, "a publication of " + callback.task), publication);
      }
      const auto same = [&](const Publication& p) { return p.topic == publication.topic; };
      if (std::any_of(callback.publishes.begin(), callback.publishes.end(), same)) {
        item.fail(callback.task + " publishes topic " + publication.topic + " twice",
                  "keep one of the rules");
      }
      if (std::find(node_.outputs.begin(), node_.outputs.end(), publication.topic) == node_.outputs.end()) {
        node_.outputs.push_back(publication.topic);
        lines_.outputs.push_back(item.line());
      }
      callback.publishes.push_back(std::move(publication));
    }
  }

  void parse_rule(const YamlMap& map, Publication& publication) const {
    map.check_keys({"topic", "when", "of", "every", "last_of", "at_percent"});
    publication.topic = map.require("topic", "TOPIC").topic();
    if (const auto at = map.find("at_percent")) publication.at = at->percent() / 100;
    const auto when = map.find("when"), of = map.find("of"), every = map.find("every"),
               last = map.find("last_of");
    if (int(when.has_value()) + int(every.has_value()) + int(last.has_value()) > 1) {
      map.fail(map.what() + " has several rules", "keep one of `when`, `every` and `last_of`");
    }
    const bool all_new = when && when->choice({"always", "all_new"}) == 1;
    if (all_new) {
      publication.rule = PublishRule::all_new;
      publication.of = inputs_of(map.require("of", "[TOPIC, TOPIC]"), map.what());
    } else if (of) {
      of->fail("`of` of " + map.what() + " needs the rule all_new", "add `when: all_new`, or remove `of`");
    } else if (every) {
      publication.rule = PublishRule::every;
      publication.n = static_cast<std::uint32_t>(every->integer(1, std::numeric_limits<std::int32_t>::max()));
    } else if (last) {
      publication.rule = PublishRule::last_of;
      publication.of = inputs_of(*last, map.what());
    }
  }

  std::vector<std::uint32_t> inputs_of(const YamlValue& value, const std::string& subject) const {
    Words topics;
    for (const Input& input : node_.inputs) topics.push_back(input.topic);
    std::vector<std::uint32_t> inputs;
    for (const YamlValue& item : value.list("an input of " + subject)) {
      const std::string topic = item.topic();
      const auto position = std::find(topics.begin(), topics.end(), topic);
      if (position == topics.end()) {
        // NOLINTNEXTLINE(performance-inefficient-string-concatenation): it ends the loop
        item.fail(subject + " waits for topic " + topic + ", to which " + what_ + " does not subscribe",
                  suggest(topic, topics));
      }
      const auto index = static_cast<std::uint32_t>(position - topics.begin());
      if (std::find(inputs.begin(), inputs.end(), index) != inputs.end()) {
        // NOLINTNEXTLINE(performance-inefficient-string-concatenation): it ends the loop
        item.fail(subject + " names topic " + topic + " twice", "name each input once");
      }
      inputs.push_back(index);
    }
    std::sort(inputs.begin(), inputs.end());
    return inputs;
  }

  const YamlMap& map_;
  const std::string& file_;
  Node& node_;
  NodeLines& lines_;
  const std::string what_ = "node " + node_.name;
};

}  // namespace

Duration parse_release_jitter(const YamlMap& timer, Duration period) {
  const auto given = timer.find("release_jitter_ms");
  if (!given) return {};
  const Duration jitter = given->milliseconds(true);
  if (jitter >= period) {
    given->fail("the release jitter of " + timer.what() + " is not below its period",
                "give less than the `period_ms`");
  }
  return jitter;
}

void parse_callbacks(const YamlMap& map, const std::string& file, Node& node, NodeLines& lines) {
  CallbackParser(map, file, node, lines).parse();
}

}  // namespace hotpath
