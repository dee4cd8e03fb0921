// SPDX-License-Identifier: Apache-2.0
#include "generator.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <vector>

#include "model.hpp"

namespace independent {

namespace {

/// Text of one callback, with its weight in place of the execution time until all weights are known.
struct Callback {
  std::string head, tail;  ///< YAML before and after the execution time.
  double weight = 0;       ///< Relative execution time.
  double rate = 0;         ///< Jobs that work, per millisecond, at most.
};

class Generator {
 public:
  /// `threads`: of the executor; several get a small graph with times of some nanoseconds.
  Generator(std::uint64_t seed, std::size_t threads)
      : random_(seed), services_(seed), other_kinds_(seed % 4 < 2), early_(seed % 8 == 0), threads_(threads) {
    if (seed % 4 == 1 && threads == 1)
      service_wait_ = 1'000'000 + static_cast<Nanoseconds>(services_() % 60'000'000);
  }

  std::string graph() {
    const std::vector<std::vector<int>> families = {{10, 20, 40, 80}, {10, 20, 30, 60},  {15, 25, 75},
                                                    {12, 18, 36},     {20, 25, 50, 100}, {30, 40, 60}};
    periods_ = families[below(families.size())];
    grid_ns_ = std::vector<Nanoseconds>{5'000'000, 1'000'000, 100'000, 1}[below(4)];
    if (threads_ > 1) {
      periods_ = std::vector<std::vector<int>>{{8, 16}, {6, 12}, {10, 20}, {8, 12, 24}, {9, 18}}[below(5)];
      unit_ = grid_ns_ = 1;
    }
    for (std::size_t n = 1 + below(threads_ > 1 ? 3 : 4); n > 0; --n) add_timers();
    for (std::size_t n = threads_ > 1 ? 1 + below(4) : 2 + below(8); n > 0; --n) add_node();
    if (threads_ == 1 && chance(0.35)) {
      for (std::size_t n = 5 + below(4); n > 0; --n) add_transform(topics_.size() - 1);
    }
    for (Callback& cyclic : cyclic_) close(cyclic);
    for (std::size_t t = 0; t < topics_.size(); ++t) {
      if (!read_.contains(t) && chance(0.6))
        add_reference("command", "input: " + input(t), work(0, rate_[t], ""));
    }
    return text();
  }

 private:
  std::size_t below(std::size_t n) { return random_() % n; }
  bool chance(double p) { return static_cast<double>(random_() % 1'000'000) < p * 1e6; }
  std::string next_name(const std::string& letter) { return letter + std::to_string(names_++); }

  static std::string ms(Nanoseconds ns) {
    std::ostringstream out;
    out << ns / 1'000'000 << '.' << std::to_string(1'000'000 + ns % 1'000'000).substr(1);
    return out.str();
  }

  std::size_t new_topic(const std::string& name, double rate) {
    topics_.push_back(name);
    rate_.push_back(rate);
    return topics_.size() - 1;
  }

  /// Recent topics are likelier: this makes graphs deep.
  std::size_t any_topic() {
    return chance(0.5) ? topics_.size() - 1 - below(std::min<std::size_t>(3, topics_.size()))
                       : below(topics_.size());
  }

  std::vector<std::size_t> distinct_topics(std::size_t n) {
    std::set<std::size_t> chosen;
    for (std::size_t i = 0; i < 20 && chosen.size() < n; ++i) chosen.insert(any_topic());
    return {chosen.begin(), chosen.end()};
  }

  std::string input(std::size_t topic) {
    read_.insert(topic);
    std::string options;
    if (chance(0.25)) options += ", depth: " + std::to_string(2 + below(3));
    if (chance(0.1)) options += ", priority: " + std::to_string(below(7));
    return options.empty() ? topics_[topic] : "{topic: " + topics_[topic] + options + "}";
  }

  std::string timer() {
    period_ = periods_[below(periods_.size())];
    const Nanoseconds period = period_ * unit_;
    const auto phase = static_cast<Nanoseconds>(below(static_cast<std::size_t>(period)));
    std::string text = "period_ms: " + (unit_ == 1 ? ms(period_) : std::to_string(period_)) +
                       ", phase_ms: " + ms(phase / grid_ns_ * grid_ns_) +
                       ", priority: " + std::to_string(1 + below(5));
    if (chance(0.3)) text += ", deadline_ms: " + ms(period / 4 * static_cast<Nanoseconds>(2 + below(5)));
    return text;
  }

  Callback work(double weight, double rate, const std::string& tail) {
    const double long_job = chance(0.15) ? 6 : 1;  // under it, others lose timestamps and samples
    return {"", tail, weight * long_job * (0.2 + static_cast<double>(below(100)) / 50), rate};
  }

  void add_reference(const std::string& type, const std::string& keys, Callback callback) {
    callback.head = "  - {name: " + next_name("N") + ", type: " + type + ", " + keys;
    callback.tail += "}\n";
    parts_.push_back(callback);
  }

  /// `shared`: callbacks keep samples for one another, so that they need one group if there are several
  /// threads.
  void begin_node(bool shared = false) {
    name_ = next_name("C");
    const bool grouped = chance(0.4) && !(shared && threads_ > 1);
    group_ = grouped ? ", group: g" : "";
    const std::string kind = other_kinds_ && services_() % 2 == 0 ? "reentrant" : "mutually_exclusive";
    parts_.push_back({"  - name: " + name_ + "\n    type: callbacks\n" +
                          (grouped ? "    groups: {g: " + kind + "}\n" : "") + "    callbacks:\n",
                      ""});
  }

  void add_callback(const std::string& keys, Callback callback) {
    callback.head = "      - {" + keys + (chance(0.5) ? group_ : "");
    callback.tail += "}\n";
    parts_.push_back(callback);
  }

  std::string subscription(std::size_t topic) {
    read_.insert(topic);
    const bool other = other_kinds_ && services_() % 3 > 0;
    has_service_ = has_service_ || other;
    const char* const kinds[] = {", service: true", ", client: true", ", waitable: true"};
    return "subscription: " + topics_[topic] + (other ? kinds[services_() % 3] : "") +
           (chance(0.25) ? ", depth: " + std::to_string(2 + below(3)) : "");
  }

  /// A sensor, or a node with several timers. Two sensors may share a topic.
  void add_timers() {
    if (chance(0.5)) {
      const std::string keys = timer();
      if (!topics_.empty() && chance(0.15)) {
        many_.insert(topics_.back());
        rate_.back() += 1.0 / period_;
        add_reference("sensor", keys + ", output: " + topics_.back(), work(0.5, 1.0 / period_, ""));
        return;
      }
      const std::string topic = next_name("t");
      add_reference("sensor", keys + ", output: " + topic, work(0.5, 1.0 / period_, ""));
      new_topic(topic, 1.0 / period_);
      return;
    }
    begin_node();
    for (std::size_t n = 1 + below(3); n > 0; --n) {
      const std::string name = next_name("t"), keys = "timer: " + name + ", " + timer();
      std::string publishes = name;
      new_topic(name, 1.0 / period_);
      if (chance(0.2)) {
        const std::string slow = next_name("t");
        publishes.insert(0, "[").append(", {topic: ").append(slow).append(", every: 2}]");
        new_topic(slow, 0.5 / period_);
      }
      add_callback(keys, work(0.5, 1.0 / period_, ", publishes: " + publishes));
    }
  }

  void add_node() {
    const std::size_t kind = below(100);
    if (kind < 25) {
      add_transform(any_topic());
    } else if (kind < 50) {
      add_fusion();
    } else if (kind < 65) {
      add_last_of();
    } else if (kind < 85) {
      add_cyclic();
    } else {
      const std::vector<std::size_t> inputs = distinct_topics(2);
      std::string connections;
      double rate = 0;
      for (const std::size_t i : inputs) {
        const std::string output = next_name("t");
        connections +=
            (connections.empty() ? "" : ", ") + ("{input: " + input(i)) + ", output: " + output + "}";
        rate += rate_[i];
        new_topic(output, rate_[i]);
      }
      add_reference("intersection", "connections: [" + connections + "]", work(1, rate, ""));
    }
  }

  void add_transform(std::size_t from) {
    const std::string topic = next_name("t");
    if (chance(0.6)) {
      add_reference("transform", "input: " + input(from) + ", output: " + topic, work(1, rate_[from], ""));
      new_topic(topic, rate_[from]);
      return;
    }
    const std::size_t every = 1 + below(3);
    begin_node();
    add_callback(
        subscription(from),
        work(1, rate_[from], ", publishes: {topic: " + topic + ", every: " + std::to_string(every) + "}"));
    new_topic(topic, rate_[from] / static_cast<double>(every));
  }

  void add_fusion() {
    const std::vector<std::size_t> inputs = distinct_topics(2 + below(2));
    if (inputs.size() < 2) return;
    double rate = 1e9;
    std::string list, of;
    for (const std::size_t i : inputs) {
      rate = std::min(rate, rate_[i]);
      of += (of.empty() ? "" : ", ") + topics_[i];
    }
    const std::string topic = next_name("t");
    if (chance(0.6)) {
      for (const std::size_t i : inputs) list += (list.empty() ? "" : ", ") + input(i);
      add_reference("fusion", "inputs: [" + list + "], output: " + topic, work(1, rate, ""));
    } else {
      begin_node(true);
      const std::string publishes = "{topic: " + topic + ", when: all_new, of: [" + of + "]}";
      for (const std::size_t i : inputs)
        add_callback(subscription(i), work(1, rate, ", publishes: " + publishes));
    }
    new_topic(topic, rate);
  }

  /// A subscription whose messages include the newest sample of another one.
  void add_last_of() {
    const std::vector<std::size_t> inputs = distinct_topics(2);
    if (inputs.size() < 2) return;
    const std::string topic = next_name("t");
    begin_node(true);
    add_callback(subscription(inputs[0]), work(chance(0.3) ? 0.3 : 0, rate_[inputs[0]], ""));
    add_callback(subscription(inputs[1]),
                 work(1, rate_[inputs[1]],
                      ", publishes: {topic: " + topic + ", last_of: [" + topics_[inputs[0]] + "]}"));
    new_topic(topic, rate_[inputs[1]]);
  }

  /// Its text is complete when all topics are known: close() may add feedback.
  void add_cyclic() {
    const std::string topic = next_name("t"), keys = timer() + ", output: " + topic;
    std::string list;
    for (const std::size_t i : distinct_topics(1 + below(3))) list += (list.empty() ? "" : ", ") + input(i);
    cyclic_.push_back(work(1, 1.0 / period_, ""));
    cyclic_.back().head = "  - {name: " + next_name("N") + ", type: cyclic, " + keys + ", inputs: [" + list;
    cyclic_from_.push_back(topics_.size());
    new_topic(topic, 1.0 / period_);
  }

  void close(Callback& cyclic) {
    const std::size_t from = cyclic_from_[static_cast<std::size_t>(&cyclic - cyclic_.data())];
    if (chance(0.3)) cyclic.head += ", " + input(from + below(topics_.size() - from));
    cyclic.head += "]";
    cyclic.tail = "}\n";
    parts_.push_back(cyclic);
  }

  std::string text() {
    double load = 0;
    for (const Callback& c : parts_) load += c.weight * c.rate;
    const double wanted = (0.25 + static_cast<double>(below(75)) / 100) * static_cast<double>(threads_);
    const bool ranges = chance(grid_ns_ == 1 ? 0.8 : 0.4);
    std::string out = "name: random\n";
    if (early_) out += "ros_distro: humble\n";
    if (has_service_) out += "service_wait_ms: " + ms(service_wait_) + "\n";
    std::string rules;
    for (const std::string& topic : topics_) {
      const bool intra_process = other_kinds_ && services_() % 3 == 0;
      const bool many = std::ranges::count(many_, topic) > 0;
      if (many || intra_process)
        rules += "  " + topic + ": {" + (many ? "publishers: many, " : "") +
                 "intra_process: " + (intra_process ? "true" : "false") + "}\n";
    }
    if (!rules.empty()) out += "topics:\n" + rules;
    out += "nodes:\n";
    for (const Callback& c : parts_) {
      const auto worst =
          static_cast<Nanoseconds>(c.weight / std::max(load, 1e-9) * wanted * static_cast<double>(unit_));
      const Nanoseconds most =
          c.weight > 0 && unit_ == 1 ? std::max(worst, unit_) : worst / grid_ns_ * grid_ns_;
      const Nanoseconds least =
          ranges
              ? std::max<Nanoseconds>(most * static_cast<Nanoseconds>(below(101)) / 100, unit_ == 1 ? 1 : 0)
              : most;
      const bool reference = c.head.starts_with("  - {");
      out += c.head;
      if (most > 0 && reference)
        out += ", execution_time_ms: " + ms(most) + ", best_case_execution_time_ms: " + ms(least);
      if (most > 0 && !reference)
        out += ", execution_time_ms: {min: " + ms(least) + ", max: " + ms(most) + "}";
      out += c.tail;
    }
    return out;
  }

  std::mt19937_64 random_;
  std::mt19937_64 services_;  ///< Apart, so that the rest of a graph does not depend on its services.
  const bool other_kinds_;    ///< Some are services, clients and waitables.
  const bool early_;          ///< Before Jazzy.
  const std::size_t threads_;
  Nanoseconds service_wait_ = 0;
  bool has_service_ = false;
  std::vector<int> periods_;
  Nanoseconds unit_ = 1'000'000;  ///< Of periods.
  int period_ = 0;                ///< Of the last timer, in units.
  Nanoseconds grid_ns_ = 1;       ///< Of phases and worst cases: coarse grids make events coincide.
  int names_ = 0;
  std::string name_, group_;  ///< Of the node being written.
  std::vector<Callback> parts_;
  std::vector<Callback> cyclic_;
  std::vector<std::size_t> cyclic_from_;  ///< Their first topics.
  std::vector<std::string> topics_;
  std::vector<double> rate_;  ///< Messages per millisecond, by topic.
  std::set<std::size_t> read_;
  std::set<std::string> many_;
};

/// Chains from all or some timers upstream of a sink: nodes and tasks on the way, in any order.
std::string chain(const Graph& graph, int sink, std::mt19937_64& random) {
  const std::size_t n = graph.tasks.size();
  std::vector<std::vector<int>> next(n);
  for (std::size_t t = 0; t < n; ++t) next[t] = successors(graph, static_cast<int>(t), false);
  const auto reached = [&](int from) {
    std::vector<bool> seen(n, false);
    std::vector<int> open = {from};
    while (!open.empty()) {
      const int t = open.back();
      open.pop_back();
      for (const int s : next[static_cast<std::size_t>(t)]) {
        if (!seen[static_cast<std::size_t>(s)]) open.push_back(s);
        seen[static_cast<std::size_t>(s)] = true;
      }
    }
    return seen;
  };
  const auto name = [&](std::size_t t) {
    return graph.tasks[t].node_in_chains ? graph.tasks[t].node : graph.tasks[t].name;
  };
  std::set<std::string> nodes = {name(static_cast<std::size_t>(sink))}, sources;
  for (std::size_t t = 0; t < n; ++t) {
    if (!graph.tasks[t].timer || static_cast<int>(t) == sink || name(t) == *nodes.begin()) continue;
    const std::vector<bool> from = reached(static_cast<int>(t));
    if (!from[static_cast<std::size_t>(sink)] || sources.size() >= 2 ||
        (!sources.empty() && random() % 3 == 0))
      continue;
    sources.insert(name(t));
    nodes.insert(name(t));
    for (std::size_t m = 0; m < n; ++m) {
      if (from[m] && reached(static_cast<int>(m))[static_cast<std::size_t>(sink)]) nodes.insert(name(m));
    }
  }
  if (sources.empty()) return "";
  const auto joined = [](const std::set<std::string>& names) {
    std::string out;
    for (const std::string& item : names) out += (out.empty() ? "" : ", ") + item;
    return out;
  };
  const std::string sink_name = name(static_cast<std::size_t>(sink));
  return "  - {name: to_" + std::to_string(sink) + ", nodes: [" + joined(nodes) + "], sources: [" +
         joined(sources) + "], sink: " + sink_name + "}\n";
}

}  // namespace

void write_random_graph(std::uint64_t seed, const std::string& file, std::size_t threads) {
  const std::string text = Generator(seed, threads).graph();
  std::ofstream(file) << text;
  const Graph graph = read_graph(file);
  std::mt19937_64 random(seed);
  std::map<std::string, std::string> chains;  // by node: a node is the sink of one chain
  for (std::size_t t = graph.tasks.size(); t-- > 0 && chains.size() < 4;) {
    const Task& task = graph.tasks[t];
    const bool stores_only = task.publications.empty() && !task.stores.empty();
    if (stores_only || task.name.find('/') == std::string::npos ? task.period == 0 : false) continue;
    if (random() % 3 == 0) continue;
    const std::string one = chain(graph, static_cast<int>(t), random);
    if (!one.empty()) chains.try_emplace(task.node, one);
  }
  std::ofstream out(file, std::ios::app);
  if (!chains.empty()) out << "chains:\n";
  for (const auto& [node, one] : chains) out << one;
}

}  // namespace independent
