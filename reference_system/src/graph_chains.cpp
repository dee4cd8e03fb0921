// SPDX-License-Identifier: Apache-2.0
// Chains of a graph file, and chains found in a graph.
#include <algorithm>
#include <map>
#include <numeric>
#include <optional>

#include "graph_source.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath {

namespace {

/// A name in the file, and its line.
struct Word {
  std::string text;
  int line = 0;
};
using Words = std::vector<Word>;

Words words_of(const GraphMap& map, const std::string& key, const std::string& item) {
  Words words;
  for (const YamlValue& value : map.needed(key).list(item)) words.push_back({value.text(), value.line()});
  return words;
}

std::vector<std::string> texts_of(const Words& words) {
  std::vector<std::string> texts;
  for (const Word& word : words) texts.push_back(word.text);
  return texts;
}

/// Reads and checks one chain of a graph file.
class ChainReader {
 public:
  ChainReader(const YamlValue& value, const GraphTasks& tasks, const Graph& graph)
      : graph_(graph), tasks_(tasks), map_(value, "a chain", KeysOf::chain) {
    map_.check();
    map_.read("name", chain_.name);
    map_.set_what(subject_ += chain_.name);
  }

  Chain read() {
    nodes_ = words_of(map_, "nodes", "a node of " + subject_);
    if (map_.find("sources")) sources_ = words_of(map_, "sources", "a source of " + subject_);
    sink_.line = map_.line();
    if (map_.read("sink", sink_.text)) sink_.line = map_.find("sink")->line();
    if (std::ranges::count(graph_.chains, chain_.name, &Chain::name) > 0)
      map_.fail("there are two chains " + chain_.name, "rename one");
    for (std::size_t place = 0; place < nodes_.size(); ++place) {
      const auto& [name, line] = nodes_[place];
      for (const TaskId id : tasks_of(nodes_[place]))
        if (!members_.emplace(id, place).second)
          map_.fail(subject_ + " lists node " + name + " twice", "list each node once", line);
    }
    if (sources_.empty() || sink_.text.empty()) complete();
    check_sink();
    if (sources_.size() > kMaxSources)
      map_.fail(subject_ + " has " + std::to_string(sources_.size()) + " sources",
                "list at most " + std::to_string(kMaxSources), sources_[kMaxSources].line);
    for (const Word& source : sources_) check_source(source);
    chain_.nodes = texts_of(nodes_);
    std::ranges::stable_sort(chain_.nodes, {}, [&](const std::string& name) { return graph_.find(name); });
    chain_.sources = texts_of(sources_);
    chain_.sink = sink_.text;
    return std::move(chain_);
  }

 private:
  std::vector<TaskId> tasks_of(const Word& word) const {
    std::vector<TaskId> named = tasks_named(graph_, tasks_, word.text);
    if (!named.empty()) return named;
    std::vector<std::string> names = graph_.node_names();
    for (const Task& task : tasks_.set.tasks)
      if (graph_.find(task.name)->type == NodeType::callbacks) names.push_back(task.name);
    map_.fail(subject_ + " visits unknown node " + word.text, suggest(word.text, names), word.line);
  }

  /// The tasks of a source or sink.
  std::vector<TaskId> member_tasks(const Word& word) const {
    std::vector<TaskId> named = tasks_of(word);
    if (std::ranges::count(nodes_, word.text, &Word::text) == 0)
      map_.fail("node " + word.text + " is missing in `nodes` of " + subject_, "list it there", word.line);
    return named;
  }

  /// Without `sink`, a chain ends in the node that feeds no other one of it;
  /// without `sources`, it begins in those that no other one feeds.
  void complete() {
    std::vector<bool> is_fed(nodes_.size()), feeds(nodes_.size());
    for (const auto& [id, place] : members_) {
      for (const TaskId next : tasks_.downstream(id)) {
        const auto to = members_.find(next);
        if (to != members_.end() && to->second != place) feeds[place] = is_fed[to->second] = true;
      }
    }
    Words first, last;
    for (std::size_t place = 0; place < nodes_.size(); ++place) {
      if (!is_fed[place] && place > 0) check_gap(place);
      if (!is_fed[place]) first.push_back({nodes_[place].text, map_.line()});
      if (!feeds[place]) last.push_back({nodes_[place].text, map_.line()});
    }
    if (sink_.text.empty() && last.size() != 1)
      map_.fail(subject_ + " has no `sink`, and ends in " +
                    (last.empty() ? "a cycle" : joined(texts_of(last), " and ")),
                "add `sink: " + (last.empty() ? nodes_ : last).front().text + "`, or another node");
    if (sources_.empty() && first.empty())
      map_.fail(subject_ + " has no `sources`, and begins in a cycle",
                "add `sources: [" + nodes_.front().text + "]`, or other nodes");
    if (sink_.text.empty()) sink_.text = last.front().text;
    if (sources_.empty()) sources_ = first;
  }

  /// Refuses a node that no other node of the chain feeds, unless data begins there.
  void check_gap(std::size_t place) const {
    const auto& [name, line] = nodes_[place];
    const std::string& before = nodes_[place - 1].text;
    for (const auto& [id, of] : members_)
      if (of == place && (tasks_.set[id].kind == TaskKind::timer || tasks_.set[id].name == name)) return;
    map_.fail(subject_ + " has a gap before " + name + ": none of its nodes feeds it",
              "list the nodes from " + before + " to " + name + ", or what else feeds it", line);
  }

  void check_sink() {
    sink_tasks_ = member_tasks(sink_);
    if (std::ranges::all_of(sink_tasks_, [&](TaskId id) { return tasks_.callbacks[id].stores_only; }))
      map_.fail("sink " + sink_.text + " of " + subject_ + " only stores its samples for other callbacks",
                "name the node, or the task that publishes them", sink_.line);
  }

  void check_source(const Word& source) const {
    const TaskId start = start_of(source);
    // The members to which data flows through members only.
    const std::vector<TaskId> reached = reached_from({start}, [&](TaskId id) {
      std::vector<TaskId> next = tasks_.downstream(id);
      std::erase_if(next, [&](TaskId other) { return !members_.contains(other); });
      return next;
    });
    if (std::ranges::find_first_of(reached, sink_tasks_) == reached.end())
      map_.fail("sink " + sink_.text + " of " + subject_ + " cannot be reached from source " + source.text +
                    " along its nodes: they end at " + graph_.nodes[tasks_.origin[reached.back()].node].name,
                "list all nodes between them in `nodes`, or choose another sink", source.line);
    if (tasks_.downstream(start).size() > tasks_.set[start].feeds.size())
      map_.fail("source " + source.text + " of " + subject_ +
                    " stores samples for messages that name only the job that publishes them",
                "begin with the node that publishes its topic", source.line);
  }

  /// The task where the data of a chain begins: the only timer, or the named task.
  TaskId start_of(const Word& source) const {
    std::vector<TaskId> tasks = member_tasks(source);
    if (tasks.size() == 1 && source.text == tasks_.set[tasks.front()].name) return tasks.front();
    std::erase_if(tasks, [&](TaskId id) { return tasks_.set[id].kind != TaskKind::timer; });
    if (tasks.size() == 1) return tasks.front();
    const std::string subject = "source " + source.text + " of " + subject_;
    if (tasks.empty())
      map_.fail(subject + " has no timer", "data begins at a sensor or a cyclic node", source.line);
    map_.fail(subject + " has " + std::to_string(tasks.size()) + " timers",
              "name the task in which data begins, such as " + tasks_.set[tasks.front()].name +
                  ", as a source and among `nodes`",
              source.line);
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  GraphMap map_;
  std::string subject_ = "chain ";
  Chain chain_;
  Words nodes_, sources_;
  Word sink_;
  std::map<TaskId, std::size_t> members_;  // tasks, and the places of their nodes
  std::vector<TaskId> sink_tasks_;
};

/// The tasks that a task's data reaches next. Includes other tasks of its node
/// only if they lead further than the task itself: not the other inputs of a fusion.
std::vector<TaskId> next_of(const GraphTasks& tasks, TaskId id) {
  const std::vector<TaskId>& own = tasks.set[id].feeds;
  std::vector<TaskId> next = tasks.downstream(id);
  std::erase_if(next, [&](TaskId other) {
    const std::vector<TaskId>& theirs = tasks.set[other].feeds;
    return tasks.origin[other].node == tasks.origin[id].node && !theirs.empty() &&
           std::ranges::all_of(theirs, [&](TaskId fed) { return std::ranges::count(own, fed) > 0; });
  });
  return next;
}

/// A path of tasks from a timer.
struct Path {
  std::vector<TaskId> tasks;
  Duration work{};

  [[nodiscard]] bool is_larger_than(const Path& other) const {
    return std::pair(tasks.size(), work) > std::pair(other.tasks.size(), other.work);
  }
};

/// The largest paths from one timer, over the graph without the edges that close cycles.
std::vector<Path> largest_paths(const GraphTasks& tasks, std::vector<std::vector<TaskId>> edges,
                                TaskId timer) {
  const std::vector<TaskId> order = cut_cycles(edges, {timer});
  std::vector<std::optional<Path>> best(edges.size());
  best[timer] = Path{{timer}, tasks.set[timer].wcet};
  std::vector<Path> paths;
  for (auto id = order.rbegin(); id != order.rend(); ++id) {
    const Path& path = *best[*id];
    for (const TaskId next : edges[*id]) {
      Path longer = path;
      longer.tasks.push_back(next);
      longer.work += tasks.set[next].wcet;
      if (!best[next] || longer.is_larger_than(*best[next])) best[next] = std::move(longer);
    }
    if (edges[*id].empty() && *id != timer && !tasks.callbacks[*id].stores_only) paths.push_back(path);
  }
  return paths;
}

/// Names the tasks of nodes of type `callbacks`, and otherwise nodes.
Chain chain_along(const Graph& graph, const GraphTasks& tasks, const Path& path, std::size_t number) {
  Chain chain;
  chain.name = "chain_" + std::to_string(number);
  for (const TaskId id : path.tasks) {
    const Node& node = graph.nodes[tasks.origin[id].node];
    const std::string& name = node.type == NodeType::callbacks ? tasks.set[id].name : node.name;
    // A cyclic node has two tasks on the path.
    if (std::ranges::count(chain.nodes, name) == 0) chain.nodes.push_back(name);
  }
  chain.sources = {chain.nodes.front()};
  chain.sink = chain.nodes.back();
  return chain;
}

}  // namespace

void read_chain(const YamlValue& value, const GraphTasks& tasks, Graph& graph) {
  graph.chains.push_back(ChainReader(value, tasks, graph).read());
}

std::vector<Chain> find_chains(const Graph& graph, const GraphTasks& tasks, std::size_t most) {
  std::vector<std::vector<TaskId>> downstream;
  for (TaskId id = 0; id < tasks.set.size(); ++id) downstream.push_back(next_of(tasks, id));
  std::vector<Path> paths;
  for (const TaskId id : tasks.set.timers())
    for (Path& path : largest_paths(tasks, downstream, id)) paths.push_back(std::move(path));
  std::ranges::stable_sort(paths, &Path::is_larger_than);
  if (paths.size() > most) paths.resize(most);
  std::vector<Chain> chains;
  chains.reserve(paths.size());
  for (const Path& path : paths) chains.push_back(chain_along(graph, tasks, path, chains.size() + 1));
  return chains;
}

ChainLimits chain_limits(const Graph& graph, const Chain& chain) {
  const GraphTasks tasks = make_tasks(graph);
  std::vector<std::vector<TaskId>> members;
  std::vector<Duration> work;
  std::uint32_t sink = 0;
  for (const std::string& name : chain.nodes) {
    if (name == chain.sink) sink = static_cast<std::uint32_t>(members.size());
    members.push_back(tasks_named(graph, tasks, name));
    Duration& most = work.emplace_back();
    for (const TaskId id : members.back()) most = std::max(most, tasks.set[id].wcet);
  }
  const auto leads_to = [&](std::uint32_t from, std::uint32_t to) {
    return std::ranges::any_of(members[from], [&](TaskId id) {
      const std::vector<TaskId> next = tasks.downstream(id);
      return std::ranges::find_first_of(next, members[to]) != next.end();
    });
  };
  std::vector<std::vector<std::uint32_t>> before(members.size());
  for (std::uint32_t node = 0; node < members.size(); ++node) {
    // A source's own inputs are not part of the chain.
    if (std::ranges::count(chain.sources, chain.nodes[node]) > 0) continue;
    for (std::uint32_t from = 0; from < members.size(); ++from)
      if (from != node && leads_to(from, node)) before[node].push_back(from);
  }
  // A node's longest branch is its own work plus that of its longest predecessor.
  std::vector<Duration> longest = work;
  for (const std::uint32_t node : cut_cycles(before, {sink}))
    for (const std::uint32_t from : before[node])
      longest[node] = std::max(longest[node], longest[from] + work[node]);
  return {longest[sink], std::accumulate(work.begin(), work.end(), Duration{})};
}

}  // namespace hotpath
