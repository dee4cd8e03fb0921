// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/live_system.hpp"

#include <Message4kbPubSubTypes.h>

#include <map>

#include "hotpath/fastdds/fastdds_transport.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/intra_process_transport.hpp"
#include "hotpath/reference_system/observe.hpp"

namespace hotpath {

namespace {

struct Message4kbTraits {
  using Message = msg::Message4kb;
  using PubSubType = msg::Message4kbPubSubType;
  static SampleInfo info(const Message& m) { return read_info(m); }
};

std::unique_ptr<Transport<msg::Message4kb>> make_transport(const LiveOptions& options) {
  if (options.transport == TransportKind::intra_process) {
    return std::make_unique<IntraProcessTransport<msg::Message4kb>>();
  }
  return std::make_unique<FastDdsTransport<Message4kbTraits>>(options.fastdds);
}

std::vector<std::string> node_names(const Graph& graph) {
  std::vector<std::string> names;
  for (const Node& node : graph.nodes) names.push_back(node.name);
  return names;
}

}  // namespace

LiveSystem::LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options,
                       RunMemory& memory)
    : tasks_(tasks),
      history_(node_names(graph)),
      chains_(index_chains(graph)),
      memory_(memory),
      chain_logs_(memory.chains()),
      transport_(make_transport(options)),
      node_(graph.nodes.size(), nullptr) {
  JobHandler& handler = *this;
  executor_ = std::make_unique<Executor>(tasks.set, options.executor->make(tasks.set, options.scheduler),
                                         handler, memory.jobs(), options.threads);
  std::map<std::string, std::uint32_t> readers, writers;
  for (const Node& node : graph.nodes) {
    for (const Input& input : node.inputs) ++readers[input.topic];
    for (const std::string& output : node.outputs) ++writers[output];
  }
  const CrunchScale scale(options.calibration);
  for (TaskId id = 0; id < tasks_.set.size(); ++id) {
    if (!tasks_.set[id].local) continue;
    const TaskOrigin origin = tasks_.origin[id];
    const Node& node = graph.nodes[origin.node];
    if (node_[origin.node] == nullptr) {
      Local& local =
          locals_.emplace_back(origin.node, node, history_, Work(graph.work, node.execution_time, scale));
      node_[origin.node] = &local;
      for (const std::string& output : node.outputs) {
        local.writers.push_back(transport_->add_writer(output, 1, readers[output]));
      }
      for (std::uint32_t c = 0; c < chains_.size(); ++c) {
        if (chains_[c].sink == origin.node) local.sink_of.push_back(c);
      }
    }
    if (origin.input) {
      const Input& input = node.inputs[*origin.input];
      transport_->add_reader(input.topic, id, input.depth, writers[input.topic], *executor_);
    }
  }
}

LiveSystem::~LiveSystem() {
  executor_->stop();
  executor_->join();
  // Samples go back to the transport while its readers exist, and its readers go before the executor they
  // call.
  executor_->close();
  locals_.clear();
  transport_.reset();
}

void LiveSystem::run(const Job& job, Time start, Sample sample, Worker worker) {
  const TaskOrigin origin = tasks_.origin[job.task];
  Local& node = *node_[origin.node];
  Activation<LiveMessages> activation;
  if (origin.input) {
    node.logic.start_subscription(*origin.input, std::move(sample), start, activation);
  } else {
    node.logic.start_timer(start, activation);
  }
  if (!activation.works) return;

  const std::int64_t result = node.work.burn(start);
  if (!activation.publishes) {
    if (activation.held[0]) observe(node, LiveMessages::message(activation.held[0]), job, start, worker);
    return;
  }
  const std::uint32_t output = node.logic.output(origin.input.value_or(0));
  msg::Message4kb& message = transport_->borrow(node.writers[output]);
  node.logic.finish(output, activation, message);
  message.data()[0] = result;
  observe(node, message, job, start, worker);
  const SampleInfo info{now(), job.deadline, job.ref()};
  write_info(message, info);
  memory_.published()[job.task].fetch_add(1, std::memory_order_relaxed);
  transport_->publish(node.writers[output], message, info);
}

void LiveSystem::observe(const Local& node, const msg::Message4kb& message, const Job& job, Time start,
                         Worker worker) {
  for (const std::uint32_t chain : node.sink_of) {
    ChainObservation observation;
    observation.chain = chain;
    if (observe_chain(history_, message, chains_[chain], job.ref(), start, observation)) {
      chain_logs_[worker].append(observation);
    }
  }
}

}  // namespace hotpath
