// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/graph_writer.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "graph_source.hpp"
#include "hotpath/core/input_error.hpp"
#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_text.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// The name of the file with a callback's measured execution times; empty: they are in the graph
/// file.
using TimesFile = std::function<std::string(const Callback&)>;

class Writer {
 public:
  Writer(const Graph& graph, const GraphComments& comments, TimesFile times_file)
      : graph_(graph), comments_(comments), times_file_(std::move(times_file)) {}

  std::string text() {
    if (!comments_.header.empty()) out_ << remark(comments_.header) << YAML::Newline;
    out_ << YAML::BeginMap;
    pair("name", graph_.name);
    if (!graph_.description.empty()) pair("description", graph_.description);
    pair("work", std::string(to_string(graph_.work)));
    if (graph_.service_wait > Duration::zero()) milliseconds("service_wait_ms", graph_.service_wait);
    if (graph_.platform != GraphPlatform{}) platform();
    topics();
    key("nodes") << YAML::BeginSeq;
    for (const Node& n : graph_.nodes) node(n);
    out_ << YAML::EndSeq;
    if (!graph_.chains.empty()) chains();
    out_ << YAML::EndMap << YAML::Newline;
    return out_.c_str();
  }

 private:
  YAML::Emitter& key(const std::string& k) { return out_ << YAML::Key << k << YAML::Value; }
  void pair(const std::string& k, const std::string& value) { key(k) << value; }
  void milliseconds(const std::string& k, Duration value) { pair(k, format_ms(value)); }
  void words(const std::string& k, const std::vector<std::string>& list) { key(k) << YAML::Flow << list; }
  void priority(const std::optional<std::int64_t>& given) {
    if (given) key("priority") << *given;
  }
  void comment(const std::string& name) {
    const auto entry = comments_.of.find(name);
    if (entry != comments_.of.end() && !entry->second.empty()) out_ << remark(entry->second);
  }
  /// Formats a comment; a line break that the emitter does not recognise would end the comment.
  static YAML::_Comment remark(const std::string& lines) {
    std::istringstream in(lines);
    std::string all;
    for (std::string line; std::getline(in, line);) all += (all.empty() ? "" : "\n") + printable(line);
    return YAML::Comment(all);
  }

  void platform() {
    const GraphPlatform& p = graph_.platform;
    key("platform") << YAML::BeginMap;
    key("cores") << p.cores;
    pair("timer_thread", std::string(to_string(p.timer_thread)));
    pair("execution_times", std::string(to_string(p.execution_times)));
    for (const PlatformCost& cost : kPlatformCosts) {
      // Microseconds have three fewer digits after the point.
      const std::optional<Duration> value = cost.in(p);
      if (value && (cost.other_kind != nullptr || *value > Duration::zero()))
        milliseconds(std::string(cost.key), *value * 1000);
    }
    out_ << YAML::EndMap;
  }

  /// Writes the topics with several publishers or an order of delivery.
  void topics() {
    std::set<std::string> once, many;
    for (const Node& n : graph_.nodes) {
      for (const std::string& topic : n.outputs) {
        if (!once.insert(topic).second) many.insert(topic);
      }
    }
    std::set<std::string> topics = many;
    for (const auto& [topic, order] : graph_.delivery) topics.insert(topic);
    if (topics.empty()) return;
    key("topics") << YAML::BeginMap;
    for (const std::string& topic : topics) {
      key(topic) << YAML::Flow << YAML::BeginMap;
      if (many.contains(topic)) pair("publishers", "many");
      const auto order = graph_.delivery.find(topic);
      if (order != graph_.delivery.end()) {
        order->second.unknown() ? pair("delivery", "unknown") : words("delivery", order->second.nodes);
      }
      out_ << YAML::EndMap;
    }
    out_ << YAML::EndMap;
  }

  void node(const Node& n) {
    const bool is_upstreams = n.type != NodeType::callbacks;
    if (is_upstreams) out_ << YAML::Flow;
    out_ << YAML::BeginMap;
    pair("name", n.name);
    if (!is_upstreams) comment(n.name);
    pair("type", std::string(to_string(n.type)));
    is_upstreams ? upstream_node(n) : callbacks_node(n);
    out_ << YAML::EndMap;
    if (is_upstreams) comment(n.name);
  }

  void upstream_node(const Node& n) {
    const Callback& last = n.callbacks.back();  // the timer, or one of several subscriptions that work alike
    if (!last.input) {
      timer(last);
      priority(last.priority);
    }
    if (n.type == NodeType::intersection) {
      connections(n);
    } else if (!n.inputs.empty()) {
      inputs(n);
    }
    const bool has_output = n.type != NodeType::intersection && !n.outputs.empty();
    if (has_output && n.outputs[0] != n.name) pair("output", n.outputs[0]);
    if (last.worst > Duration::zero()) milliseconds("execution_time_ms", last.worst);
    if (last.best != last.worst) milliseconds("best_case_execution_time_ms", last.best);
    if (n.groups[0] != CallbackGroup::mutually_exclusive) {
      pair("callback_group", std::string(to_string(n.groups[0])));
    }
  }

  void timer(const Callback& of) {
    milliseconds("period_ms", of.period);
    if (of.phase) milliseconds("phase_ms", *of.phase);
    if (of.deadline != of.period) milliseconds("deadline_ms", of.deadline);
    if (of.release_jitter > Duration::zero()) milliseconds("release_jitter_ms", of.release_jitter);
  }

  void connections(const Node& n) {
    key("connections") << YAML::BeginSeq;
    for (std::size_t i = 0; i < n.inputs.size(); ++i) {
      out_ << YAML::BeginMap << YAML::Key << "input" << YAML::Value;
      input(n, i);
      pair("output", n.outputs[i]);
      out_ << YAML::EndMap;
    }
    out_ << YAML::EndSeq;
  }

  void inputs(const Node& n) {
    const bool several = n.inputs.size() > 1;
    key(several ? "inputs" : "input");
    if (several) out_ << YAML::BeginSeq;
    for (std::size_t i = 0; i < n.inputs.size(); ++i) input(n, i);
    if (several) out_ << YAML::EndSeq;
  }

  void input(const Node& n, std::size_t index) {
    const auto& [topic, depth] = n.inputs[index];
    const bool given_depth = depth != default_depth(n.type);
    if (!given_depth && !n.callbacks[index].priority) {
      out_ << topic;
      return;
    }
    out_ << YAML::BeginMap;
    pair("topic", topic);
    if (given_depth) key("depth") << depth;
    priority(n.callbacks[index].priority);
    out_ << YAML::EndMap;
  }

  void callbacks_node(const Node& n) {
    if (!n.group_names.empty()) {
      key("groups") << YAML::Flow << YAML::BeginMap;
      for (std::size_t g = 0; g < n.group_names.size(); ++g) {
        pair(n.group_names[g], std::string(to_string(n.groups[g])));
      }
      out_ << YAML::EndMap;
    }
    key("callbacks") << YAML::BeginSeq;
    for (const Callback& c : n.callbacks) callback(n, c);
    out_ << YAML::EndSeq;
  }

  void callback(const Node& n, const Callback& c) {
    out_ << YAML::Flow << YAML::BeginMap;
    const std::string name = c.task.substr(n.name.size() + 1);
    if (c.input) {
      pair("subscription", name);
      const std::uint32_t depth = n.inputs[*c.input].depth;
      if (depth != default_depth(n.type)) key("depth") << depth;
      if (c.service) key("service") << true;
    } else {
      pair("timer", name);
      timer(c);
    }
    priority(c.priority);
    execution_time(c);
    if (c.group < n.group_names.size()) pair("group", n.group_names[c.group]);
    if (!c.publishes.empty()) key("publishes");
    if (c.publishes.size() > 1) out_ << YAML::BeginSeq;
    for (const Publication& p : c.publishes) publication(n, p);
    if (c.publishes.size() > 1) out_ << YAML::EndSeq;
    out_ << YAML::EndMap;
    comment(c.task);
  }

  void execution_time(const Callback& c) {
    if (!c.measured && c.best == c.worst) {
      if (c.worst > Duration::zero()) milliseconds("execution_time_ms", c.worst);
      return;
    }
    key("execution_time_ms") << YAML::BeginMap;
    const bool listed = c.measured && c.quantiles.empty();
    const std::string file = listed ? times_file_(c) : std::string();
    if (!file.empty()) {
      pair("file", file);
    } else if (listed) {
      std::vector<std::string> values;
      for (const Duration value : *c.measured) values.push_back(format_ms(value));
      words("measured", values);
    } else {
      milliseconds("min", c.best);
      for (const DurationQuantile& q : c.quantiles) {
        if (q.percent > 0 && q.percent < 100)
          milliseconds("p" + std::to_string(std::lround(q.percent)), q.time);
      }
      milliseconds("max", c.worst);
    }
    out_ << YAML::EndMap;
  }

  void publication(const Node& n, const Publication& p) {
    if (p.rule == PublishRule::always && p.at == 1) {
      out_ << p.topic;
      return;
    }
    out_ << YAML::BeginMap;
    pair("topic", p.topic);
    std::vector<std::string> of;
    for (const std::uint32_t i : p.of) of.push_back(n.inputs[i].topic);
    if (p.rule == PublishRule::every) key("every") << p.n;
    if (p.rule == PublishRule::last_of) words("last_of", of);
    if (p.rule == PublishRule::all_new) {
      pair("when", "all_new");
      words("of", of);
    }
    if (p.at < 1) milliseconds("at_percent", Duration(std::llround(p.at * 1e8)));
    out_ << YAML::EndMap;
  }

  void chains() {
    key("chains") << YAML::BeginSeq;
    for (const Chain& c : graph_.chains) {
      out_ << YAML::BeginMap;
      pair("name", c.name);
      words("nodes", c.nodes);
      words("sources", c.sources);
      pair("sink", c.sink);
      out_ << YAML::EndMap;
    }
    out_ << YAML::EndSeq;
  }

  const Graph& graph_;
  const GraphComments& comments_;
  const TimesFile times_file_;
  YAML::Emitter out_;
};

[[noreturn]] void cannot_write(const fs::path& file) {
  throw InputError(file.string(), 0, "the file cannot be written", "choose a writable folder");
}

/// The name of a times file; replaces the slashes of topics.
std::string times_name(const Callback& callback) {
  std::string name = callback.task + ".csv";
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

}  // namespace

void write_text_file(const fs::path& file, const std::string& text) {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directory(file.parent_path(), error);
  std::ofstream out(file);
  out << text;
  out.close();
  if (!out) cannot_write(file);
}

std::string graph_yaml(const Graph& graph, const GraphComments& comments) {
  return Writer(graph, comments, [](const Callback&) { return std::string(); }).text();
}

void write_graph(const fs::path& file, const Graph& graph, const GraphComments& comments,
                 const TextWriter& write) {
  if (file.has_parent_path() && !fs::is_directory(file.parent_path())) cannot_write(file);
  const fs::path folder = file.stem().string() + "_times";
  const auto times_file = [&](const Callback& callback) -> std::string {
    if (callback.measured->size() <= kMaxInlineTimes) return {};
    std::string lines = "execution_time_ms\n";
    for (const Duration value : *callback.measured) lines += format_ms(value) + "\n";
    write(file.parent_path() / folder / times_name(callback), lines);
    return (folder / times_name(callback)).string();
  };
  write(file, Writer(graph, comments, times_file).text());
}

}  // namespace hotpath
