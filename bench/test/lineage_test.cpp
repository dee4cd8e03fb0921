// SPDX-License-Identifier: Apache-2.0
// Every output's source, path and instants against a second way to follow its data: forwards through the
// columns of jobs.csv, with slots that a node's jobs fill and its messages empty. Shares no code with
// bench/explain and NodeLogic.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <tuple>

#include "explained.hpp"
#include "random_graphs.hpp"
#include "reference_nodes.hpp"

namespace hotpath::explain::lineage_test {

using namespace std::chrono_literals;

constexpr std::size_t kOwn = ~std::size_t{0};  // a sink's sample, in place of a publication

using Id = std::pair<TaskId, std::uint64_t>;  // a job: its task and sequence
Id id_of(JobRef job) { return {job.task, job.sequence}; }

/// Gives nodes what random_graph() lacks: `every`, early publications, second publications, and fusions of a
/// cyclic node with one of its inputs, whose samples most of the cyclic node's messages lack.
void vary_rules(Graph& graph, test::Random& random) {
  std::vector<Node> readers;
  for (Node& node : graph.nodes) {
    if (node.type == NodeType::cyclic && test::chance(random, 60)) {
      const std::string &own = node.outputs.front(), &input = node.inputs.back().topic;
      readers.push_back(reference_node("F" + node.name, NodeType::fusion, {{own, 1, {}}, {input, 1, {}}}));
    }
    if (node.type == NodeType::sensor || node.outputs.empty() || !test::chance(random, 60)) continue;
    node.type = NodeType::callbacks;
    for (Callback& callback : node.callbacks) {
      if (callback.publishes.empty()) continue;
      Publication& first = callback.publishes.front();
      if (first.rule == PublishRule::always && test::chance(random, 40))
        first = {PublishRule::every, 2, 0, 1, {}, first.topic};
      if (first.rule != PublishRule::last_of && test::chance(random, 20)) first.at = 0.5;
      if (!test::chance(random, 40)) continue;
      Publication second;
      second.topic = "x" + std::to_string(readers.size());
      second.rule = PublishRule::always;
      for (std::uint32_t i = 0; i < node.inputs.size(); ++i)
        if (i != callback.input && test::chance(random, 70)) second.of.push_back(i);
      const bool waits = callback.input && !second.of.empty() && test::chance(random, 50);
      if (waits) second.of.insert(std::ranges::lower_bound(second.of, *callback.input), *callback.input);
      if (!second.of.empty()) second.rule = waits ? PublishRule::all_new : PublishRule::last_of;
      readers.push_back(reference_node("R" + second.topic, NodeType::command, {{second.topic, 1, {}}}));
      node.outputs.push_back(second.topic);
      callback.publishes.push_back(second);
    }
  }
  graph.nodes.insert(graph.nodes.end(), readers.begin(), readers.end());
}

/// A chain from all timers upstream to each node without a timer.
void add_chains(Graph& graph) {
  const GraphTasks tasks = make_tasks(graph);
  const auto node_of = [&](TaskId id) { return tasks.origin[id].node; };
  std::map<std::uint32_t, Chain> chains;
  std::set<std::uint32_t> cyclic;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].kind != TaskKind::timer) continue;
    cyclic.insert(node_of(id));
    std::set<std::uint32_t> nodes;
    for (const TaskId at : reached_from({id}, [&](TaskId from) { return tasks.downstream(from); }))
      nodes.insert(node_of(at));
    for (const std::uint32_t sink : nodes) {
      std::vector<std::string>& sources = chains[sink].sources;
      if (sources.size() < kMaxSources) sources.push_back(graph.nodes[node_of(id)].name);
    }
  }
  graph.chains.clear();
  for (auto& [sink, chain] : chains) {
    if (cyclic.contains(sink)) continue;
    chain.name = chain.sink = graph.nodes[sink].name;
    for (const Node& node : graph.nodes) chain.nodes.push_back(node.name);
    graph.chains.push_back(chain);
  }
}

struct Followed {
  std::uint32_t chain = 0;
  Id sink;
  std::size_t publication = kOwn;
  Duration latency{};
  std::set<Id> contained;  ///< All jobs whose data it has, also beside an older job of their task.
};
auto key(const Followed& f) { return std::tuple(f.chain, f.sink.first, f.sink.second, f.latency); }

/// Follows all samples of a run.
class Lineage {
 public:
  Lineage(const Graph& graph, const GraphTasks& tasks, const Trace& trace)
      : graph_(graph), tasks_(tasks), chains_(index_chains(graph, tasks)), jobs_of_(tasks.set.size()) {
    for (const JobRecord& r : trace.jobs)
      if (r.job.parent.task != kNoTask)
        published_.emplace(std::pair(id_of(r.job.parent), topic_of(r.job.task)), r.job.timestamp);
    for (const JobRecord& r : trace.jobs) {
      if (!r.started()) continue;
      publish_until(r.start);
      start(r);
    }
    publish_until(trace.end);
  }

  const std::vector<Followed>& outputs() const { return outputs_; }
  /// The publication of `from` that `to` took.
  std::size_t publication_for(Id from, TaskId to) const {
    const auto& all = tasks_.callbacks[from.first].publishes;
    const auto own = std::ranges::find(all, topic_of(to), &Publication::topic);
    return static_cast<std::size_t>(own - all.begin());
  }
  /// Whether the message `publication` of `to` contains the sample that `from` stored.
  bool stored(Id from, Id to, std::size_t publication) const {
    return slots_of_.contains({from, to, publication});
  }

 private:
  struct Content {
    std::map<TaskId, std::pair<std::uint64_t, Time>> oldest;  // by task: sequence and start
    std::set<Id> all;
  };
  struct Sample {
    Id by;
    Content content;
  };
  using Slots = std::map<std::uint32_t, Sample>;  // by input
  struct Message {
    Time at;
    const JobRecord* job;
    std::size_t publication;
    std::vector<Sample> taken;
    Content own;
  };

  std::string topic_of(TaskId subscription) const {
    const TaskOrigin& origin = tasks_.origin[subscription];
    return origin.input ? graph_.nodes[origin.node].inputs[*origin.input].topic : "";
  }

  /// The slots of a publication: those of an `all_new` are shared by the callbacks of a node.
  Slots& slots(TaskId task, std::size_t publication) {
    const Publication& p = tasks_.callbacks[task].publishes[publication];
    const bool shared = p.rule == PublishRule::all_new;
    return slots_[{tasks_.origin[task].node, shared ? kNoTask : task, p.topic, p.of}];
  }

  void start(const JobRecord& r) {
    const JobRef ref = r.job.ref();
    const std::uint32_t node = tasks_.origin[ref.task].node;
    const std::optional<std::uint32_t> input = tasks_.origin[ref.task].input;
    Content own;
    if (input) {
      const auto message =
          messages_.find({id_of(r.job.parent), publication_for(id_of(r.job.parent), ref.task)});
      ASSERT_NE(message, messages_.end()) << tasks_.set[ref.task].name << " " << ref.sequence;
      own = message->second;
    }
    for (TaskId id = 0; input && id < tasks_.set.size(); ++id) {
      if (tasks_.origin[id].node != node) continue;
      const auto& publishes = tasks_.callbacks[id].publishes;
      for (std::size_t p = 0; p < publishes.size(); ++p)
        if (std::ranges::count(publishes[p].of, *input) > 0) slots(id, p)[*input] = {id_of(ref), own};
    }
    const std::uint64_t count = jobs_of_[ref.task]++ + 1;
    const auto& publishes = tasks_.callbacks[ref.task].publishes;
    for (std::size_t p = 0; p < publishes.size(); ++p) {
      Message message{r.outcome == Outcome::ran ? r.finish : kNever, &r, p, {}, own};
      const auto arrived = published_.find({id_of(ref), publishes[p].topic});
      if (arrived != published_.end()) message.at = arrived->second;
      if (publishes[p].rule == PublishRule::every && count % publishes[p].n != 0) continue;
      if (publishes[p].rule == PublishRule::all_new) {
        if (slots(ref.task, p).size() < publishes[p].of.size()) continue;
        for (auto& [slot, sample] : slots(ref.task, p)) message.taken.push_back(std::move(sample));
        slots(ref.task, p).clear();
      }
      waiting_.push_back(std::move(message));
    }
    if (publishes.empty() && input && r.outcome == Outcome::ran)
      waiting_.push_back({r.finish, &r, kOwn, {}, std::move(own)});
  }

  void publish_until(Time now) {
    std::ranges::stable_sort(waiting_, {}, &Message::at);
    std::size_t done = 0;
    for (; done < waiting_.size() && waiting_[done].at <= now; ++done) publish(waiting_[done]);
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(done));
  }

  void publish(Message& m) {
    const JobRef ref = m.job->job.ref();
    if (m.publication == kOwn) return observe(m, m.own);
    if (tasks_.callbacks[ref.task].publishes[m.publication].rule == PublishRule::last_of) {
      for (auto& [slot, sample] : slots(ref.task, m.publication)) m.taken.push_back(std::move(sample));
      slots(ref.task, m.publication).clear();
    }
    Content content = m.own;
    for (const Sample& sample : m.taken) {
      slots_of_.insert({sample.by, id_of(ref), m.publication});
      for (const auto& [task, job] : sample.content.oldest) {
        const auto known = content.oldest.emplace(task, job).first;
        known->second = std::min(known->second, job);
      }
      content.all.insert(sample.content.all.begin(), sample.content.all.end());
    }
    content.oldest[ref.task] = {ref.sequence, m.job->start};
    content.all.insert(id_of(ref));
    observe(m, content);
    messages_[{id_of(ref), m.publication}] = std::move(content);
  }

  void observe(const Message& m, const Content& content) {
    const JobRef ref = m.job->job.ref();
    for (std::uint32_t c = 0; c < chains_.size(); ++c) {
      if (!chains_[c].ends_in(ref.task) || observed_.contains({c, id_of(ref)})) continue;
      Time latest = Time::min();
      for (const TaskId source : chains_[c].sources) {
        const auto job = content.oldest.find(source);
        if (job != content.oldest.end()) latest = std::max(latest, job->second.second);
      }
      if (latest == Time::min()) continue;
      observed_.insert({c, id_of(ref)});
      outputs_.push_back({c, id_of(ref), m.publication, m.job->start - latest, content.all});
    }
  }

  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::vector<ChainIndex> chains_;
  std::map<std::pair<Id, std::string>, Time> published_;  // by publisher and topic
  std::vector<std::uint64_t> jobs_of_;
  std::map<std::tuple<std::uint32_t, TaskId, std::string, std::vector<std::uint32_t>>, Slots> slots_;
  std::vector<Message> waiting_;
  std::map<std::pair<Id, std::size_t>, Content> messages_;
  std::set<std::tuple<Id, Id, std::size_t>> slots_of_;
  std::set<std::pair<std::uint32_t, Id>> observed_;
  std::vector<Followed> outputs_;
};

/// Checks an explanation; the path may be any along which the data went.
void check(const Explanation& e, const Followed& output, const ChainIndex& chain, const Lineage& lineage,
           const std::map<Id, const JobRecord*>& jobs) {
  ASSERT_TRUE(e.complete);
  ASSERT_EQ(e.latency, output.latency);
  const Id source = id_of(e.path.front().job.ref());
  ASSERT_EQ(std::ranges::count(chain.sources, source.first), 1);
  ASSERT_TRUE(output.contained.contains(source)) << "the output lacks the data of this job";
  ASSERT_EQ(e.path.back().start - e.path.front().start, output.latency);
  std::size_t publication = output.publication;
  for (std::size_t i = e.path.size(); i-- > 0;) {
    const JobRecord& job = *jobs.at(id_of(e.path[i].job.ref()));
    ASSERT_EQ(e.path[i].start, job.start);
    ASSERT_EQ(e.path[i].finish, job.outcome == Outcome::ran ? job.finish : kNever);
    if (i == 0) break;
    const Id before = id_of(e.path[i - 1].job.ref());
    if (id_of(job.job.parent) == before) {
      publication = lineage.publication_for(before, job.job.task);
    } else {
      ASSERT_TRUE(lineage.stored(before, id_of(job.job.ref()), publication))
          << "step " << i << " of " << e.path.size() << ": the message does not contain the sample";
    }
  }
}

/// Returns the number of outputs.
std::size_t check_run(const Graph& graph, const setup::ExecutorSpec& spec, std::uint64_t seed) {
  const Simulated run(graph, spec, Phases::random, 1s, seed);
  const Lineage lineage(run.graph(), run.tasks(), run.trace());
  std::map<Id, const JobRecord*> jobs;
  for (const JobRecord& r : run.trace().jobs)
    if (r.started()) jobs[id_of(r.job.ref())] = &r;
  // When a job publishes that runs at the end of the run is known from its readers alone.
  const auto ended = [&](Id job) { return jobs.at(job)->outcome == Outcome::ran; };
  std::vector<std::tuple<std::uint32_t, TaskId, std::uint64_t, Duration>> followed, recorded;
  for (const Followed& output : lineage.outputs())
    if (ended(output.sink)) followed.push_back(key(output));
  for (const ChainRecord& r : run.trace().chains)
    if (ended({r.sink, r.sequence})) recorded.emplace_back(r.chain, r.sink, r.sequence, r.hot_path_latency);
  std::ranges::sort(followed);
  std::ranges::sort(recorded);
  EXPECT_EQ(followed, recorded);
  if (followed != recorded) return 0;
  std::size_t explained = 0;
  for (std::uint32_t c = 0; c < graph.chains.size(); ++c) {
    std::map<Id, const Followed*> by_sink;
    std::vector<Output> outputs;
    for (const Followed& f : lineage.outputs()) {
      if (f.chain != c || f.latency < Duration{}) continue;
      by_sink[f.sink] = &f;
      outputs.push_back({0, f.sink.second, f.latency, f.sink.first});
    }
    for (const Explanation& e : run.explained(c, outputs, Latency::hot_path)) {
      const JobRecord& sink = e.path.back();
      SCOPED_TRACE(graph.chains[c].name + " " + run.tasks().set[sink.job.task].name + " " +
                   std::to_string(sink.job.sequence));
      const auto output = by_sink.find(id_of(sink.job.ref()));
      EXPECT_NE(output, by_sink.end()) << "no output of the chain";
      if (output != by_sink.end()) check(e, *output->second, run.system().chains[c], lineage, jobs);
      ++explained;
    }
  }
  return explained;
}

TEST(Lineage, ExplanationsFollowTheDataInRandomGraphs) {
  std::size_t outputs = 0;
  std::set<PublishRule> rules;
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    test::Random random(seed);
    Graph graph = test::random_graph(random);
    vary_rules(graph, random);
    add_chains(graph);
    graph.platform.cores = 1 + seed % 2;
    for (const Node& node : graph.nodes)
      for (const Callback& c : callbacks_of(node))
        for (const Publication& p : c.publishes) rules.insert(p.rule);
    for (const char* name :
         {"default", "static", "multi:3", "multi-jazzy:2", "cbg:3", "events-re", "rm-ro", "edf-re"}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " " + name);
      try {
        outputs += check_run(graph, setup::parse_executor(name, {}), seed);
      } catch (const SimulationError&) {
        // An overload under this executor.
      }
      if (HasFailure()) return;
    }
  }
  EXPECT_GE(outputs, 10'000U);
  EXPECT_EQ(rules.size(), 4U);
}

}  // namespace hotpath::explain::lineage_test
