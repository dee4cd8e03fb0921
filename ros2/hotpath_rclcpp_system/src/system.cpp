// SPDX-License-Identifier: Apache-2.0
#include "system.hpp"

#include <rcl/timer.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "executors.hpp"

namespace hotpath {

namespace {

using Messages = LiveMessages<TaskHistory<BoundedMessage>>;

const ExecutorEntry& entry_of(const nlohmann::json& plan) {
  const std::string text = plan.at("executor");
  const ExecutorEntry* entry = find_executor(text.substr(0, text.find(':')));
  if (entry == nullptr) throw std::runtime_error("there is no executor `" + text + "`");
  return *entry;
}

/// Makes rcl's timer due at `first`, then every `period`.
void set_phase(rclcpp::TimerBase& timer, Time first, Duration period) {
  const rcl_timer_t* handle = timer.get_timer_handle().get();
  std::int64_t before = 0;
  const Duration until = std::max(first - now(), Duration(1));
  if (rcl_timer_exchange_period(handle, until.count(), &before) != RCL_RET_OK) before = 0;
  timer.reset();
  if (before == 0 || rcl_timer_exchange_period(handle, period.count(), &before) != RCL_RET_OK) {
    throw std::runtime_error(std::string("a timer cannot be set: ") + rcl_get_error_string().str);
  }
}

}  // namespace

RclcppSystem::RclcppSystem(const Graph& graph, const GraphTasks& tasks, const nlohmann::json& plan,
                           RunMemory& memory)
    : tasks_(tasks),
      memory_(memory),
      logs_(memory.jobs()),
      entry_(entry_of(plan)),
      tasks_of_run_(tasks.set.size()),
      executor_threads_(plan.at("threads")) {
  auto transport = std::make_unique<RclcppTransport>(graph, tasks_, plan.at("namespace"));
  transport_ = transport.get();
  nodes_ = std::make_unique<TypedLiveNodes<Messages>>(
      graph, tasks_, Calibration{plan.at("divisions_per_us")}, memory,
      TaskHistory<BoundedMessage>(ChainLanes(graph, tasks_)), std::move(transport));
  nodes_->connect(*this, nullptr);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const auto feeders = std::ranges::count_if(
        tasks.set.tasks, [&](const Task& t) { return std::ranges::count(t.feeds, id) > 0; });
    tasks_of_run_[id].one_writer = feeders <= 1;
  }
  executor_ = make_executor(entry_, plan);
  ours_ = dynamic_cast<const PriorityExecutor*>(executor_.get());
  if (plan.contains("executor_policy")) policy_ = {parse_thread_policy(plan.at("executor_policy")), true, {}};
}

RclcppSystem::~RclcppSystem() { end_spinning(); }

void RclcppSystem::add_timer(TaskId task) {
  const rclcpp::Node::SharedPtr& node = transport_->nodes()[tasks_.origin[task].node];
  const Duration period = tasks_.set[task].period;
#if RCLCPP_VERSION_GTE(28, 0, 0)
  const auto callback = [this, task](const rclcpp::TimerInfo& info) {
    run_timer(task, from_ns(info.expected_call_time.nanoseconds()));
  };
#else
  const auto callback = [this, task] { run_timer(task, std::nullopt); };
#endif
  tasks_of_run_[task].timer = node->create_wall_timer(period, callback, transport_->group(task));
  set_phase(*tasks_of_run_[task].timer, epoch_ + tasks_.set[task].phase, period);
}

void RclcppSystem::start(Time epoch, Time end) {
  epoch_ = epoch;
  end_ = end;
  for (const TaskId id : tasks_.set.timers()) add_timer(id);
  for (const auto& node : transport_->nodes()) executor_->add_node(node);
  thread_ = std::thread([this] { spin(); });
  while (!settled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (ended_ && error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void RclcppSystem::spin() {
  try {
    if (ours_ == nullptr) {
      // The threads that rclcpp starts inherit the policy.
      if (policy_.required) policy_.policy = apply_thread_policy(policy_);
      prepared_ = true;
    }
    executor_->spin();
  } catch (...) {
    error_ = std::current_exception();
  }
  ended_ = true;
}

bool RclcppSystem::settled() const {
  return ended_ ||
         (ours_ != nullptr ? !ours_->thread_policies().empty() : prepared_ && is_spinning(*executor_));
}

void RclcppSystem::stop() { end_ = std::min(end_.load(), now()); }

void RclcppSystem::end_spinning() {
  if (!thread_.joinable()) return;
  executor_->cancel();
  thread_.join();
}

Time RclcppSystem::join() {
  end_spinning();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  return std::min(end_.load(), now());
}

std::vector<WorkerThread> RclcppSystem::workers() const {
  std::vector<WorkerThread> workers;
  if (ours_ != nullptr) {
    for (const std::string& text : ours_->thread_policies()) {
      const std::size_t space = text.find(' ');
      workers.push_back(
          {*parse<WorkerRole>(text.substr(0, space)), parse_thread_policy(text.substr(space + 1))});
    }
    return workers;
  }
  workers.assign(executor_threads_, {WorkerRole::executor, policy_.policy});
  if (entry_.traits.timers != TimerHandling::polled) {
    workers.push_back({WorkerRole::timer_management, policy_.policy});
  }
  return workers;
}

Worker RclcppSystem::own_worker(bool timer) {
  const auto workers = static_cast<Worker>(memory_.chains().size());
  if (entry_.traits.timers == TimerHandling::release_and_execute) return timer ? 1 : 0;
  thread_local const Worker own = threads_.fetch_add(1);
  return std::min(own, workers - 1);
}

void RclcppSystem::write(const JobRecord& record, Worker worker) { logs_[worker].append(record); }

void RclcppSystem::run(JobRecord& record, Sample sample) {
  record.job.release = std::max(record.job.timestamp, record.job.release);
  nodes_->run(record.job, record.start, std::move(sample), record.worker);
  record.finish = now();
  record.cpu = static_cast<std::int16_t>(sched_getcpu());
}

void RclcppSystem::count_sample(OfTask& subscription, const JobRecord& record) {
  // Only the gap before the next sample reveals the overwritten ones.
  for (; subscription.next < record.job.sequence; ++subscription.next) {
    JobRecord lost = record;
    lost.job.sequence = subscription.next;
    lost.outcome = Outcome::overwritten;
    if (executor_threads_ > 1) {
      subscription.missing.emplace(subscription.next, lost);
    } else {
      write(lost, record.worker);
    }
  }
  subscription.missing.erase(record.job.sequence);
  subscription.next = std::max(subscription.next, record.job.sequence + 1);
}

void RclcppSystem::deliver(TaskId task, const SampleInfo& info, Sample sample) {
  JobRecord record;
  record.start = now();
  if (record.start >= end_.load()) return;
  OfTask& own = tasks_of_run_[task];
  record.worker = static_cast<std::uint16_t>(own_worker(false));
  record.job.task = task;
  record.job.timestamp = record.job.release = info.published;
  record.job.deadline = info.deadline;
  record.job.parent = info.parent;
  {
    const std::lock_guard lock(own.mutex);
    record.job.sequence = own.one_writer ? sample.as<BoundedMessage>().publication() : own.next;
    count_sample(own, record);
  }
  if (const auto running = PriorityExecutor::running_callback()) record.job.release = Time(running->release);
  run(record, std::move(sample));
  write(record, record.worker);
}

std::uint64_t RclcppSystem::timer_sequence(TaskId task, std::optional<Time> expected) {
  const Task& timer = tasks_.set[task];
  const Time first = epoch_ + timer.phase;
  const auto index = [&](Time nominal) {
    return static_cast<std::uint64_t>(
        std::max<std::int64_t>(0, (nominal - first + timer.period / 2) / timer.period));
  };
  if (const auto running = PriorityExecutor::running_callback()) return index(Time(running->timestamp));
  if (expected) return index(*expected);
  // rcl has already called the timer: its next call is one period after the last skipped timestamp.
  OfTask& own = tasks_of_run_[task];
  const std::uint64_t sequence = own.next;
  own.next = index(now() + own.timer->time_until_trigger());
  return std::min(sequence, own.next - 1);
}

void RclcppSystem::timer_starts(OfTask& timer, std::uint64_t sequence, Worker worker) {
  if (timer.newest && sequence <= *timer.newest) {  // another thread overtook this one
    timer.skipped_by.emplace(sequence, 0);
    return;
  }
  const auto skipped = timer.newest ? static_cast<std::uint32_t>(sequence - *timer.newest - 1) : 0;
  if (timer.last) {
    timer.last->job.skipped = skipped;
    write(*std::exchange(timer.last, std::nullopt), worker);
  } else if (timer.newest) {
    timer.skipped_by.emplace(*timer.newest, skipped);
  }
  timer.newest = sequence;
}

void RclcppSystem::timer_finished(OfTask& timer, JobRecord& record) {
  const auto known = timer.skipped_by.extract(record.job.sequence);
  if (known.empty()) {
    timer.last = record;
    return;
  }
  record.job.skipped = known.mapped();
  write(record, record.worker);
}

void RclcppSystem::run_timer(TaskId task, std::optional<Time> expected) {
  JobRecord record;
  record.start = now();
  if (record.start >= end_.load()) return;
  const Task& timer = tasks_.set[task];
  OfTask& own = tasks_of_run_[task];
  record.worker = static_cast<std::uint16_t>(own_worker(true));
  record.job.task = task;
  {
    const std::lock_guard lock(own.mutex);
    record.job.sequence = timer_sequence(task, expected);
    timer_starts(own, record.job.sequence, record.worker);
  }
  record.job.timestamp = epoch_ + timer.phase + timer.period * static_cast<std::int64_t>(record.job.sequence);
  record.job.deadline = record.job.timestamp + timer.deadline;
  record.job.release = record.start;
  if (const auto running = PriorityExecutor::running_callback()) record.job.release = Time(running->release);
  run(record, {});
  const std::lock_guard lock(own.mutex);
  timer_finished(own, record);
}

void RclcppSystem::close(Time end) {
  for (TaskId id = 0; id < tasks_.set.size(); ++id) {
    OfTask& own = tasks_of_run_[id];
    const Task& task = tasks_.set[id];
    const bool timer = task.kind == TaskKind::timer;
    std::uint64_t reached = memory_.published()[id].load(), next = own.next;
    if (timer) {
      const Time first = epoch_ + task.phase;
      reached = end <= first ? 0 : 1 + static_cast<std::uint64_t>((end - Duration(1) - first) / task.period);
      next = own.newest ? *own.newest + 1 : 0;
      if (own.last) write(*own.last, own.last->worker);
    }
    for (const auto& [sequence, lost] : own.missing) write(lost, lost.worker);
    // Jobs that were due or unread but did not start.
    for (; next < reached; ++next) {
      JobRecord queued;
      queued.job.task = id;
      queued.job.sequence = next;
      queued.job.timestamp =
          timer ? epoch_ + task.phase + task.period * static_cast<std::int64_t>(next) : end - Duration(1);
      queued.outcome = Outcome::queued;
      write(queued, queued.worker);
    }
  }
  executor_.reset();
}

}  // namespace hotpath
