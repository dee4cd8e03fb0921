// SPDX-License-Identifier: Apache-2.0
// The driver's arrivals and callbacks: work that it does outside its lock.
#include <pthread.h>

#include <algorithm>
#include <mutex>
#include <rclcpp/experimental/subscription_intra_process_base.hpp>

#include "driver.hpp"
#include "trace_events.hpp"

namespace hotpath {

namespace {

/// The job that the calling thread runs. Nested, since callbacks may spin another executor.
struct Running {
  const ExecutorDriver* driver = nullptr;
  const Job* job = nullptr;  ///< Lives until its callback has ended.
};
thread_local Running running;

class RunningScope {
 public:
  RunningScope(const ExecutorDriver* driver, const Job& job)
      : outer_(std::exchange(running, {driver, &job})) {}
  ~RunningScope() { running = outer_; }
  RunningScope(const RunningScope&) = delete;
  RunningScope& operator=(const RunningScope&) = delete;

 private:
  const Running outer_;
};

/// Gives access to rclcpp's protected functions that take and handle one item.
struct Access : rclcpp::Executor {
  static void run(const rclcpp::SubscriptionBase::SharedPtr& s) { execute_subscription(s); }
  static void run(const rclcpp::ServiceBase::SharedPtr& s) { execute_service(s); }
  static void run(const rclcpp::ClientBase::SharedPtr& c) { execute_client(c); }
};

template <class Entity>
bool take_and_run(const Entry& entry) {
  const auto entity = lock<Entity>(entry);
  if (entity) Access::run(entity);
  return entity != nullptr;
}

const rclcpp::Logger& logger() {
  static const rclcpp::Logger instance = rclcpp::get_logger("hotpath_rclcpp");
  return instance;
}

}  // namespace

std::optional<RunningCallback> ExecutorDriver::running_callback() {
  if (running.driver == nullptr) return std::nullopt;
  const Job& job = *running.job;
  return RunningCallback{job.timestamp.time_since_epoch(), job.release.time_since_epoch(), job.sequence,
                         job.skipped};
}

void ExecutorDriver::prepare(Worker worker) {
  const bool timer = schedule_.scheduler().workers()[worker] == WorkerRole::timer_management;
  ThreadPolicyRequest wanted = timer ? setup().timer_thread : setup().executor_threads;
  if (worker > 0) {
    pthread_setname_np(pthread_self(), timer ? "hotpath_timers" : "hotpath_worker");
    minimise_timer_slack();
  }
  // The thread that calls spin() keeps its policy unless a policy is required; the other executor
  // threads inherit it.
  const ThreadPolicy inherited = own_thread_policy();
  const bool stays = !wanted.required && (worker == 0 || wanted.policy == ThreadPolicy{});
  if (!stays && !wanted.required) {
    wanted.policy.priority = std::max(wanted.policy.priority, raised_above(inherited).priority);
  }
  if (!stays) static_cast<void>(apply_thread_policy(wanted));
  const ThreadPolicy obtained = own_thread_policy();
  {
    const std::lock_guard lock(mutex_);
    lanes_[worker].policy = obtained;
  }
  trace::executor_thread(&schedule_, worker, schedule_.scheduler().workers()[worker], obtained);
  if (stays || obtained == wanted.policy) return;
  static std::once_flag told;
  std::call_once(told, [&] {
    RCLCPP_WARN(logger(),
                "policy %s is not permitted: the timer thread uses policy %s. Give the user an rtprio limit "
                "or the program CAP_SYS_NICE.",
                to_string(wanted.policy).c_str(), to_string(obtained).c_str());
  });
}

void ExecutorDriver::arrived(const std::shared_ptr<Entry>& entry, std::size_t count, int which) {
  wake_claimed([&] {
    WorkerSet claimed;
    if (entry->number == kNoTask) return claimed;
    const Time now = hotpath::now();
    if (releases_) release_until(now);  // earlier than this sample
    SampleInfo info{now, kNever, {}};
    // A sample delivered during the publishing call comes from the job that this thread runs.
    if (running.driver == this) {
      info.deadline = running.job->deadline;
      info.parent = running.job->ref();
      if (schedule_.learn(running.job->task, entry)) notices_.order_changed(now, longest_period_, true);
    } else if (!entry->topic.empty()) {
      notices_.came_from_outside(entry, now, longest_period_);
    }
    info.deadline = schedule_.deadline_of(*entry, info.deadline, now);
    for (; count > 0; --count) {
      if (entry->is_waitable()) entry->ready.push_back(which);
      claimed |= enqueue(entry, info, now);
    }
    return claimed;
  });
}

WorkerSet ExecutorDriver::enqueue(const std::shared_ptr<Entry>& entry, const SampleInfo& info, Time now) {
  ++entry->events;
  return claim(schedule_.scheduler().sample_arrived(entry->number, info, now).wake);
}

bool ExecutorDriver::execute(const std::shared_ptr<Entry>& entry, const Started& started) {
  const Job& job = started.job;
  const RunningScope scope(this, job);
  trace::executor_job(&schedule_, job);
  const bool ran = run_callback(entry, started);
  trace::executor_end(&schedule_, *entry, job.task);
  return ran;
}

bool ExecutorDriver::run_callback(const std::shared_ptr<Entry>& entry, const Started& started) {
  if (entry->is_timer()) {
    const auto timer = lock<rclcpp::TimerBase>(*entry);
    if (timer) return execute_timer(entry, *timer, started);
    leave(entry);  // the timer is gone; rclcpp does not report that
    return false;
  }
  switch (entry->task.entity) {
    case EntityKind::subscription:
      // An event whose sample was overwritten may still find a newer sample; its job counts as
      // empty anyway.
      return take_and_run<rclcpp::SubscriptionBase>(*entry) && !started.job.empty;
    case EntityKind::service:
      return take_and_run<rclcpp::ServiceBase>(*entry);
    case EntityKind::client:
      return take_and_run<rclcpp::ClientBase>(*entry);
    case EntityKind::waitable:
    case EntityKind::intra_process: {
      const auto waitable = lock<rclcpp::Waitable>(*entry);
      return waitable && started.which && execute_waitable(*entry, *waitable, *started.which);
    }
  }
  return false;
}

bool ExecutorDriver::execute_waitable(const Entry& entry, rclcpp::Waitable& waitable, int which) {
  if (entry.task.entity == EntityKind::intra_process) {
    auto& subscription = static_cast<rclcpp::experimental::SubscriptionIntraProcessBase&>(waitable);
    if (!versions::has_message(subscription)) return false;
  }
  versions::run(waitable, which);
  return true;
}

void ExecutorDriver::log(const Notices::Lines& lines) {
  if (!lines.info.empty()) RCLCPP_INFO(logger(), "%s", lines.info.c_str());
  for (const std::string& text : lines.warnings) RCLCPP_WARN(logger(), "%s", text.c_str());
  for (const std::string& text : lines.order) RCLCPP_DEBUG(logger(), "%s", text.c_str());
}

void ExecutorDriver::check_options() {
  Notices::Lines lines;
  {
    const std::lock_guard lock(mutex_);
    lines.warnings = notices_.of_options(schedule_);
  }
  log(lines);
}

std::vector<std::string> ExecutorDriver::order() {
  const std::lock_guard lock(mutex_);
  return schedule_.order();
}

std::vector<std::string> ExecutorDriver::thread_policies() {
  const std::lock_guard lock(mutex_);
  const std::span<const WorkerRole> roles = schedule_.scheduler().workers();
  std::vector<std::string> texts;
  for (std::size_t worker = 0; worker < (without_timer_thread_ ? 1 : lanes_.size()); ++worker) {
    if (!lanes_[worker].policy) return {};
    texts.push_back(to_string(WorkerThread{roles[worker], *lanes_[worker].policy}));
  }
  return texts;
}

void ExecutorDriver::set_priority(const std::shared_ptr<void>& entity, std::int64_t priority, bool service) {
  if (!entity) throw std::invalid_argument("set_priority: the entity is a null pointer; pass a valid one");
  const std::lock_guard lock(mutex_);
  schedule_.set_priority(entity, priority, service, now());
}

}  // namespace hotpath
