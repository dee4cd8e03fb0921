// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_file.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <sstream>

#include "graph_source.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/utf8.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

class Writer : private YamlWriter {
 public:
  /// Many measured execution times of a callback go into a file in `times_folder`, unless it is empty.
  Writer(const Graph& graph, const GraphComments& comments, fs::path times_folder)
      : graph_(graph), comments_(comments), times_folder_(std::move(times_folder)) {}

  std::string text() {
    if (!comments_.header.empty()) out << remark(comments_.header) << YAML::Newline;
    out << YAML::BeginMap;
    pair("name", graph_.name);
    pair(KeysOf::graph, "description", graph_.description);
    pair("work", graph_.work);
    pairs(KeysOf::graph, graph_keys::kOfGraph, graph_);
    if (graph_.platform != GraphPlatform{}) platform(graph_.platform);
    topics();
    list("nodes", graph_.nodes, [&](const Node& n) { node(n); });
    if (!graph_.chains.empty()) list("chains", graph_.chains, [&](const Chain& c) { chain(c); });
    out << YAML::EndMap << YAML::Newline;
    return out.c_str();
  }
  /// After text(): the other files, by path.
  [[nodiscard]] const std::vector<std::pair<fs::path, std::string>>& times_files() const { return files_; }

 private:
  void list(const std::string& name, const auto& items, const auto& write) {
    key(name) << YAML::BeginSeq;
    for (const auto& item : items) write(item);
    out << YAML::EndSeq;
  }
  /// A single item stands without a list.
  void one_or_list(const auto& items, const auto& write) {
    if (items.size() > 1) out << YAML::BeginSeq;
    for (const auto& item : items) write(item);
    if (items.size() > 1) out << YAML::EndSeq;
  }
  void comment(const std::string& name) {
    const auto entry = comments_.of.find(name);
    if (entry != comments_.of.end() && !entry->second.empty()) out << remark(entry->second);
  }
  /// Formats a comment; a line break that the emitter does not recognise would end the comment.
  static YAML::_Comment remark(const std::string& lines) {
    std::istringstream in(lines);
    std::string all;
    for (std::string line; std::getline(in, line);) all += (all.empty() ? "" : "\n") + printable(line);
    return YAML::Comment(all);
  }

  void platform(const GraphPlatform& p) {
    key("platform") << YAML::BeginMap;
    std::apply([&](const auto&... key) { (pair(key.first, p.*key.second), ...); }, graph_keys::kOfPlatform);
    for (const PlatformCost& cost : kPlatformCosts) {
      const std::optional<Duration> value = cost.in(p);
      if (value && (cost.other_kind != nullptr || *value > Duration::zero()))
        pair(std::string(cost.key), *value * 1000);  // in microseconds
    }
    pair(KeysOf::platform, "measured_delivery_us", p.measured_delivery.longest * 1000);
    pair(KeysOf::platform, "median_delivery_us", p.measured_delivery.median * 1000);
    pair(KeysOf::platform, "delivery_samples", p.measured_delivery.samples);
    out << YAML::EndMap;
  }

  /// Writes the topics with several publishers, an order of delivery, or intra-process communication.
  void topics() {
    std::map<std::string, std::size_t> publishers;
    for (const Node& n : graph_.nodes)
      for (const std::string& topic : n.outputs) ++publishers[topic];
    std::set<std::string> topics = graph_.intra_process;
    for (const auto& [topic, count] : publishers)
      if (count > 1) topics.insert(topic);
    for (const auto& [topic, order] : graph_.delivery) topics.insert(topic);
    if (topics.empty()) return;
    key("topics") << YAML::BeginMap;
    for (const std::string& topic : topics) {
      key(topic) << YAML::Flow << YAML::BeginMap;
      if (publishers[topic] > 1) pair("publishers", "many");
      pair(KeysOf::topic_rule, "intra_process", graph_.intra_process.contains(topic));
      const auto order = graph_.delivery.find(topic);
      if (order != graph_.delivery.end()) {
        order->second.unknown() ? pair("delivery", "unknown") : words("delivery", order->second.nodes);
      }
      out << YAML::EndMap;
    }
    out << YAML::EndMap;
  }

  void node(const Node& n) {
    const bool is_short = n.type != NodeType::callbacks;
    if (is_short) out << YAML::Flow;
    out << YAML::BeginMap;
    pair("name", n.name);
    if (!is_short) comment(n.name);
    pair("type", n.type);
    is_short ? short_form(n) : long_form(n);
    out << YAML::EndMap;
    if (is_short) comment(n.name);
  }

  void short_form(const Node& n) {
    const auto of = static_cast<KeysOf>(n.type);
    const Callback& last = n.callbacks.back();  // the timer, or one of several subscriptions that work alike
    if (!last.input) timer(of, last);
    if (n.type == NodeType::intersection) {
      list("connections", n.callbacks, [&](const Callback& c) {
        out << YAML::BeginMap << YAML::Key << "input" << YAML::Value;
        input(n, c);
        pair("output", c.publishes.front().topic);
        out << YAML::EndMap;
      });
    } else if (!n.inputs.empty()) {
      key(n.inputs.size() > 1 ? "inputs" : "input");
      const std::span subscriptions(n.callbacks.data(), n.inputs.size());
      one_or_list(subscriptions, [&](const Callback& c) { input(n, c); });
    }
    const bool has_output = n.type != NodeType::intersection && !n.outputs.empty();
    if (has_output && n.outputs[0] != n.name) pair("output", n.outputs[0]);
    pair(of, "execution_time_ms", last.worst);
    if (last.best != last.worst) pair("best_case_execution_time_ms", last.best);
    pair(of, "callback_group", n.groups[0]);
  }

  void timer(KeysOf of, Callback c) {
    if (c.deadline == c.period) c.deadline = {};
    pairs(of, graph_keys::kOfTimer, c);
  }

  void input(const Node& n, const Callback& c) {
    const auto& [topic, depth] = n.inputs[*c.input];
    if (depth == default_depth(n.type) && !c.priority) {
      out << topic;
      return;
    }
    out << YAML::BeginMap;
    pair("topic", topic);
    if (depth != default_depth(n.type)) pair("depth", depth);
    pair(KeysOf::input, "priority", c.priority);
    out << YAML::EndMap;
  }

  void long_form(const Node& n) {
    if (!n.group_names.empty()) {
      key("groups") << YAML::Flow << YAML::BeginMap;
      for (std::size_t g = 0; g < n.group_names.size(); ++g) pair(n.group_names[g], n.groups[g]);
      out << YAML::EndMap;
    }
    list("callbacks", n.callbacks, [&](const Callback& c) { callback(n, c); });
  }

  void callback(const Node& n, const Callback& c) {
    out << YAML::Flow << YAML::BeginMap;
    const std::string name = c.task.substr(n.name.size() + 1);
    if (c.input) {
      pair("subscription", name);
      pair(KeysOf::subscription, "depth", n.inputs[*c.input].depth);
      if (c.entity != EntityKind::subscription) pair(std::string(to_string(c.entity)), true);
      pair(KeysOf::subscription, "priority", c.priority);
    } else {
      pair("timer", name);
      timer(KeysOf::timer, c);
    }
    execution_time(c);
    if (c.group < n.group_names.size()) pair("group", n.group_names[c.group]);
    if (!c.publishes.empty()) {
      key("publishes");
      one_or_list(c.publishes, [&](const Publication& p) { publication(n, p); });
    }
    out << YAML::EndMap;
    comment(c.task);
  }

  void execution_time(const Callback& c) {
    if (!c.measured && c.best == c.worst) return pair(KeysOf::timer, "execution_time_ms", c.worst);
    key("execution_time_ms") << YAML::BeginMap;
    const bool listed = c.measured && c.quantiles.empty();
    std::vector<std::string> values;
    for (std::size_t i = 0; listed && i < c.measured->size(); ++i)
      values.push_back(format_ms((*c.measured)[i]));
    if (values.size() > kMaxInlineTimes && !times_folder_.empty()) {
      std::string name = c.task + ".csv";
      std::ranges::replace(name, '/', '-');  // of topics
      files_.emplace_back(times_folder_ / name, "execution_time_ms\n" + joined(values, "\n") + "\n");
      pair("file", files_.back().first.string());
    } else if (listed) {
      words("measured", values);
    } else {
      pair("min", c.best);
      for (const DurationQuantile& q : c.quantiles)
        if (q.percent > 0 && q.percent < 100) pair("p" + std::to_string(std::lround(q.percent)), q.time);
      pair("max", c.worst);
    }
    out << YAML::EndMap;
  }

  void publication(const Node& n, const Publication& p) {
    if (p.rule == PublishRule::always && p.at == 1) {
      out << p.topic;
      return;
    }
    out << YAML::BeginMap;
    pair("topic", p.topic);
    std::vector<std::string> of;
    for (const std::uint32_t i : p.of) of.push_back(n.inputs[i].topic);
    if (p.rule == PublishRule::every) pair("every", p.n);
    if (p.first > 0 && p.first < p.n) pair("first", p.first);
    if (p.rule == PublishRule::last_of) words("last_of", of);
    if (p.rule == PublishRule::all_new) {
      pair("when", "all_new");
      words("of", of);
    }
    if (p.at < 1) pair("at_percent", Duration(std::llround(p.at * 1e8)));  // with as many digits as a time
    out << YAML::EndMap;
  }

  void chain(const Chain& c) {
    out << YAML::BeginMap;
    pair("name", c.name);
    words("nodes", c.nodes);
    words("sources", c.sources);
    pair("sink", c.sink);
    out << YAML::EndMap;
  }

  const Graph& graph_;
  const GraphComments& comments_;
  const fs::path times_folder_;
  std::vector<std::pair<fs::path, std::string>> files_;
};

}  // namespace

std::string graph_yaml(const Graph& graph, const GraphComments& comments) {
  return Writer(graph, comments, {}).text();
}

void write_graph(const fs::path& file, const Graph& graph, const GraphComments& comments,
                 const TextWriter& write) {
  if (file.has_parent_path() && !fs::is_directory(file.parent_path()))
    throw InputError(file.string(), 0, "the file cannot be written", "choose a writable folder");
  Writer writer(graph, comments, file.stem().string() + "_times");
  const std::string text = writer.text();
  for (const auto& [path, times] : writer.times_files()) write(file.parent_path() / path, times);
  write(file, text);
}

}  // namespace hotpath
