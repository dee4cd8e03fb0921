// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/transport.hpp"
#include "hotpath/reference_system/live_system.hpp"
#include "hotpath/reference_system/node_logic.hpp"
#include "hotpath/reference_system/run_memory.hpp"
#include "hotpath/reference_system/work.hpp"

namespace hotpath {

/// Samples on a live transport. `H` is the sample management, `P` the generated type support of its
/// message, if any.
template <class H, class P = void>
struct LiveMessages {
  using History = H;
  using Message = typename H::Message;
  using PubSubType = P;
  using Held = Sample;
  using Mutex = std::mutex;
  static const Message& message(const Sample& held) { return held.as<Message>(); }
  static Sample share(const Sample& held) { return held.share(); }
  static SampleInfo info(const Message& m) { return read_info(m); }
  static bool valid(const Message& m, TaskId tasks) { return is_message_of(m, tasks); }
};

/// LiveNodes with messages of one type.
template <class Messages>
class TypedLiveNodes final : public LiveNodes {
 public:
  using History = typename Messages::History;
  using Message = typename Messages::Message;

  TypedLiveNodes(const Graph& graph, const GraphTasks& tasks, const Calibration& calibration,
                 RunMemory& memory, const History& history, std::unique_ptr<Transport<Message>> transport)
      : graph_(graph),
        tasks_(tasks),
        history_(history),
        chains_(index_chains(graph, tasks)),
        memory_(memory),
        chain_logs_(memory.chains()),
        ends_(tasks.set.size()),
        transport_(std::move(transport)),
        nodes_(graph.nodes.size()),
        jobs_(chain_logs_.size()) {
    for (std::uint32_t c = 0; c < chains_.size(); ++c) {
      for (const TaskId id : chains_[c].sink_tasks) ends_[id].push_back(c);
    }
    for (const Callback& callback : tasks_.callbacks)
      work_.push_back(parts_of(graph.work, callback, calibration.divisions_per_us));
  }

  void connect(SampleSink& sink, const SensorCalls* sensor) override {
    sensor_ = sensor;
    std::map<std::string, std::uint32_t> readers, writers;
    for (const Node& node : graph_.nodes) {
      for (const Input& input : node.inputs) ++readers[input.topic];
      for (const std::string& output : node.outputs) ++writers[output];
    }
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      const TaskOrigin origin = tasks_.origin[id];
      if (!tasks_.set[id].local || origin.callback > 0) continue;
      const Node& node = graph_.nodes[origin.node];
      Local& local = *(nodes_[origin.node] = std::make_unique<Local>(node, history_));
      for (const std::string& output : node.outputs) {
        local.writers.push_back(transport_->add_writer(output, 1, readers[output]));
      }
      for (Activation<Messages>& job : jobs_) local.logic.reserve(job, chains_.size());
    }
    // Readers created after their writer get samples in the order in which the readers were created,
    // within one process: with Fast DDS, also through rclcpp, and with the in-process transport.
    for (const TaskId id : tasks_.subscriptions_to_create()) {
      const TaskOrigin origin = tasks_.origin[id];
      if (!tasks_.set[id].local) continue;
      const Input& input = graph_.nodes[origin.node].inputs[*origin.input];
      transport_->add_reader(input.topic, id, input.depth, writers[input.topic], sink);
    }
  }

  void wait_until_matched(Time deadline) override { transport_->wait_until_matched(deadline); }

  void run(const Job& job, Time start, Sample sample, Worker worker) override {
    if (sensor_ != nullptr) sensor_->start(job, static_cast<bool>(sample));
    const TaskOrigin& origin = tasks_.origin[job.task];
    Local& node = *nodes_[origin.node];
    Activation<Messages>& activation = jobs_[worker];
    node.logic.start(origin.callback, job.ref(), std::move(sample), start, activation);
    if (activation.works) {
      for (const WorkPart& part : work_[job.task]) {
        const std::int64_t result = part.burn(start);
        for (std::size_t i = 0; i < activation.messages.size(); ++i) {
          if (activation.messages[i].at == part.end) publish(node, job, activation, i, result, worker);
        }
      }
      if (tasks_.readers[job.task].empty() && activation.own) {
        observe(Messages::message(activation.own), activation, worker);
      }
    }
    activation.clear();
    if (sensor_ != nullptr) sensor_->end(job.task);
  }

 private:
  struct Local {
    Local(const Node& node, const History& history) : logic(node, history) {}
    NodeLogic<Messages> logic;
    std::vector<typename Transport<Message>::WriterId> writers;  // parallel to the node's outputs
  };

  void publish(Local& node, const Job& job, Activation<Messages>& activation, std::size_t index,
               std::int64_t result, Worker worker) {
    const std::uint32_t output = activation.messages[index].output;
    const auto writer = node.writers[output];
    Message& message = transport_->borrow(writer);
    node.logic.finish(activation, index, message);
    observe(message, activation, worker);
    const SampleInfo info{now(), job.deadline, job.ref()};
    if (sensor_ != nullptr) sensor_->publish(tasks_.origin[job.task].node, output, info.published);
    complete(message, info, result);
    for (const TaskId reader : tasks_.readers[job.task][activation.messages[index].publication]) {
      memory_.published()[reader].fetch_add(1, std::memory_order_relaxed);
    }
    transport_->publish(writer, message, info);
  }

  void observe(const Message& message, Activation<Messages>& job, Worker worker) {
    observe_chains(history_, message, chains_, ends_[job.ref.task], job,
                   [&](const ChainObservation& observation) { chain_logs_[worker].append(observation); });
  }

  const Graph& graph_;
  const GraphTasks tasks_;
  const History history_;
  const std::vector<ChainIndex> chains_;
  RunMemory& memory_;
  const SensorCalls* sensor_ = nullptr;  // nullptr: none
  std::vector<RecordLog<ChainObservation>> chain_logs_;
  std::vector<std::vector<std::uint32_t>> ends_;  // by task: chains
  std::vector<std::vector<WorkPart>> work_;       // per task: up to each instant of publication, and the end

  std::unique_ptr<Transport<Message>> transport_;  // declared before everything that holds its samples
  std::vector<std::unique_ptr<Local>> nodes_;      // nullptr: in another process
  std::vector<Activation<Messages>> jobs_;         // by worker
};

}  // namespace hotpath
