// SPDX-License-Identifier: Apache-2.0
#include "import/run_events.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

namespace hotpath::imports {

namespace {

using K = tracing::EventKind;

/// Addresses by type of entity and index.
enum Entity : std::uint64_t {
  node = 1,
  publisher,
  rmw_publisher,
  subscription,
  rmw_subscription,
  rclcpp_subscription,
  timer,
  callback
};
std::uint64_t address(Entity entity, std::uint64_t index) {
  return (std::uint64_t{entity} << 32) + 16 * (index + 1);
}
constexpr std::uint64_t kMessage = std::uint64_t{9} << 32, kExecutor = std::uint64_t{10} << 32;

/// A simulation does not say on which processor a job ran. This gives each job one on which its
/// thread may run: the last one of its thread or another one without a running job, otherwise one
/// whose running job ends later, so that this one preempts it. A job whose thread is bound to its
/// processor is not preempted by one whose thread may run elsewhere, if that preempts another one.
class Processors {
 public:
  /// `jobs`: in the order of starts. Those that are bound to a processor come first at one instant.
  Processors(const ExportedRun& run, const std::vector<const JobRecord*>& jobs)
      : run_(run), running_(run.cores), of_job_(jobs.size()) {
    std::vector<std::size_t> order(jobs.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {},
                             [&](std::size_t j) { return std::pair(jobs[j]->start, may_move(*jobs[j])); });
    for (const std::size_t j : order) of_job_[j] = jobs[j]->cpu >= 0 ? jobs[j]->cpu : choose(*jobs[j]);
  }

  /// Of a job by its place in the order of starts.
  std::int32_t of(std::size_t job) const { return of_job_[job]; }

 private:
  bool may_move(const JobRecord& r) const {
    return r.worker >= run_.processors.size() || run_.processors[r.worker].size() != 1;
  }

  std::int32_t choose(const JobRecord& r) {
    const auto [last, is_new] =
        last_.try_emplace({r.process, r.worker}, static_cast<int>(r.worker % run_.cores));
    std::vector<int> allowed(run_.cores);
    std::iota(allowed.begin(), allowed.end(), 0);
    if (r.worker < run_.processors.size() && !run_.processors[r.worker].empty())
      allowed = run_.processors[r.worker];
    std::erase_if(allowed, [&](int p) { return p >= static_cast<int>(run_.cores); });
    if (allowed.empty()) allowed = {last->second};
    const auto own = std::ranges::find(allowed, last->second);
    if (own != allowed.end()) std::iter_swap(allowed.begin(), own);
    for (const int p : allowed)
      std::erase_if(running_[static_cast<std::size_t>(p)],
                    [&](const JobRecord* other) { return end_of(*other) <= r.start; });
    const auto rank = [&](int p) {
      const std::vector<const JobRecord*>& on = running_[static_cast<std::size_t>(p)];
      if (on.empty()) return 0;
      const bool ends_later = end_of(*on.back()) >= end_of(r);
      return may_move(*on.back()) ? (ends_later ? 1 : 2) : (ends_later ? 3 : 4);
    };
    last->second = *std::ranges::min_element(allowed, {}, rank);
    running_[static_cast<std::size_t>(last->second)].push_back(&r);
    return last->second;
  }

  static Time end_of(const JobRecord& r) { return r.outcome == Outcome::ran ? r.finish : Time::max(); }

  const ExportedRun& run_;
  std::vector<std::vector<const JobRecord*>> running_;           // by processor, the innermost last
  std::map<std::pair<std::uint16_t, std::uint16_t>, int> last_;  // by process and worker
  std::vector<std::int32_t> of_job_;
};

class EventWriter {
 public:
  explicit EventWriter(const ExportedRun& run) : run_(run) {}

  RunEvents events(bool distinct) {
    find_publications();
    initialise();
    add_jobs();
    std::ranges::stable_sort(events_, {}, &tracing::Event::at);
    if (distinct) separate_processors();
    return {std::move(events_), names_};
  }

 private:
  using Numbers = std::array<std::uint64_t, 4>;
  using Texts = std::array<const char*, 2>;

  /// An event on a process's main thread. Ids of threads are unique in a system.
  static tracing::Event on_main_thread(std::uint16_t process) {
    const std::uint32_t id = 1000U * (1U + process);
    return {.process = id, .thread = id, .processor = 0};
  }

  /// Readers merge the streams of processors by time alone. Events of two processors at one instant
  /// of virtual time get a nanosecond of distance, in the order of cause and effect.
  void separate_processors() {
    const tracing::Event* last = nullptr;
    for (tracing::Event& e : events_) {
      if (last != nullptr && e.at <= last->at)
        e.at = last->at + Duration(e.processor == last->processor ? 0 : 1);
      last = &e;
    }
  }

  /// Adds an event on the thread of `where`.
  void add(Time at, K kind, tracing::Event where, const Numbers& numbers = {}, Texts texts = {"", ""}) {
    where.at = at;
    where.kind = kind;
    where.number = numbers;
    where.text = texts;
    events_.push_back(where);
  }

  const char* ros_name(const std::string& topic) { return names_->insert("/" + topic).first->c_str(); }

  /// Finds the publications of each job that a reader received.
  void find_publications() {
    for (const JobRecord& r : run_.trace.jobs) {
      if (r.job.parent.task != kNoTask)
        published_[{r.job.parent.task, r.job.parent.sequence}][r.job.task] = r.job.timestamp;
    }
  }

  void initialise() {
    std::set<std::uint16_t> processes;
    std::map<std::uint32_t, std::uint16_t> process_of;  // by node
    for (const JobRecord& r : run_.trace.jobs) {
      if (r.outcome == Outcome::ran) process_of[run_.tasks.origin[r.job.task].node] = r.process;
    }
    Duration earliest{};
    for (const Task& task : run_.tasks.set.tasks) earliest = std::min(earliest, task.phase - task.period);
    const Time begin = kExportedEpoch + earliest - std::chrono::milliseconds(1);
    std::uint64_t publishers = 0;
    for (std::uint32_t n = 0; n < run_.graph.nodes.size(); ++n) {
      const tracing::Event where = on_main_thread(process_of[n]);
      if (processes.insert(process_of[n]).second) {
        add(begin, K::rcl_init, where, {1}, {run_.jazzy ? "9.2.0" : "8.0.0", ""});
        if (std::ranges::count(run_.states_jobs, true) > 0)
          add(begin, K::executor_init, where, {kExecutor}, {"hotpath", ""});
      }
      const Node& of = run_.graph.nodes[n];
      add(begin, K::node_init, where, {address(node, n), address(node, n) + 8}, {of.name.c_str(), "/"});
      for (const std::string& topic : of.outputs) {
        publisher_of_[{n, topic}] = publishers;
        add(begin, K::publisher_init, where,
            {address(publisher, publishers), address(node, n), address(rmw_publisher, publishers), 10},
            {ros_name(topic), ""});
        ++publishers;
      }
    }
    const auto thread = [&](TaskId id) { return on_main_thread(process_of.at(run_.tasks.origin[id].node)); };
    for (const TaskId id : run_.tasks.subscriptions_to_create()) initialise(id, begin, thread(id));
    for (TaskId id = 0; id < run_.tasks.set.size(); ++id)
      if (!run_.tasks.origin[id].input) initialise(id, begin, thread(id));
  }

  void initialise(TaskId id, Time begin, const tracing::Event& where) {
    const TaskOrigin& origin = run_.tasks.origin[id];
    const Task& task = run_.tasks.set[id];
    const Texts name = {task.name.c_str(), ""};
    if (origin.input) {
      const Input& input = run_.graph.nodes[origin.node].inputs[*origin.input];
      add(begin, K::subscription_init, where,
          {address(subscription, id), address(node, origin.node), address(rmw_subscription, id), input.depth},
          {ros_name(input.topic), ""});
      add(begin, K::rclcpp_subscription_init, where,
          {address(subscription, id), address(rclcpp_subscription, id)});
      add(begin, K::subscription_callback_added, where,
          {address(rclcpp_subscription, id), address(callback, id)});
      add(begin, K::callback_register, where, {address(callback, id)}, name);
      return;
    }
    const Time created = kExportedEpoch + task.phase - task.period;
    add(created, K::timer_init, where, {address(timer, id), static_cast<std::uint64_t>(task.period.count())});
    add(created, K::timer_callback_added, where, {address(timer, id), address(callback, id)});
    add(created, K::callback_register, where, {address(callback, id)}, name);
    add(created, K::timer_link_node, where, {address(timer, id), address(node, origin.node)});
  }

  /// Adds jobs in the order of starts. At one instant they have the order of the trace: a job of another
  /// thread that ends at once may publish what this one did not find yet.
  void add_jobs() {
    std::vector<const JobRecord*> jobs;
    for (const JobRecord& r : run_.trace.jobs)
      if (started(r)) jobs.push_back(&r);
    std::ranges::stable_sort(jobs, {}, &JobRecord::start);
    std::map<std::pair<std::uint16_t, std::uint16_t>, const JobRecord*> previous;  // by process and worker
    const Processors processors(run_, jobs);
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const JobRecord* const r = jobs[j];
      tracing::Event where = on_main_thread(r->process);
      where.thread += r->worker;
      where.processor = processors.of(j);
      const JobRecord*& before = previous[{r->process, r->worker}];
      if (r->worker < run_.polled.size() && run_.polled[r->worker]) add_executor_events(*r, before, where);
      before = r;
      add_job(*r, where);
    }
  }

  Time traced(Time t) const { return kExportedEpoch + (t - run_.trace.epoch); }

  /// A job that became ready after the start of the previous one needed another wait.
  void add_executor_events(const JobRecord& r, const JobRecord* before, const tracing::Event& where) {
    const Time start = traced(r.start);
    const bool idle = before == nullptr || before->finish < before->start;
    if (before == nullptr || r.job.release > before->start)
      add(idle ? start : traced(before->finish), K::wait_for_work, where, {static_cast<std::uint64_t>(-1)});
    add(start, K::get_next_ready, where);
    add(start, K::execute, where,
        {address(run_.tasks.origin[r.job.task].input ? subscription : timer, r.job.task)});
  }

  void add_job(const JobRecord& r, const tracing::Event& where) {
    const TaskId id = r.job.task;
    const Time start = traced(r.start);
    if (run_.tasks.origin[id].input) {
      add(start, K::rmw_take, where,
          {address(rmw_subscription, id), kMessage, stamp_of(traced(r.job.timestamp)), 1});
      add(start, K::rcl_take, where, {kMessage});
      add(start, K::rclcpp_take, where, {kMessage});
    }
    if (r.worker < run_.states_jobs.size() && run_.states_jobs[r.worker])
      add(start, K::executor_job, where,
          {kExecutor, id, stamp_of(traced(r.job.timestamp)), stamp_of(traced(r.job.release))});
    add(start, K::callback_start, where, {address(callback, id)});
    if (r.outcome != Outcome::ran) return;
    const auto received = published_.find({id, r.job.sequence});
    for (std::size_t p = 0; p < run_.tasks.readers[id].size(); ++p) {
      const Publication& publication = run_.tasks.callbacks[id].publishes[p];
      const std::vector<TaskId>& readers = run_.tasks.readers[id][p];
      Time at = r.finish;
      bool publishes = readers.empty() &&
                       (publication.rule == PublishRule::always || publication.rule == PublishRule::last_of);
      for (const TaskId reader : readers) {
        if (received == published_.end() || !received->second.contains(reader)) continue;
        publishes = true;
        at = std::min(at, received->second.at(reader));
      }
      if (!publishes) continue;
      const std::uint64_t of = publisher_of_.at({run_.tasks.origin[id].node, publication.topic});
      const Time published = traced(at);
      add(published, K::rclcpp_publish, where, {kMessage + 8});
      add(published, K::rcl_publish, where, {address(publisher, of), kMessage + 8});
      add(published, K::rmw_publish, where, {address(rmw_publisher, of), kMessage + 8, stamp_of(published)});
    }
    add(traced(r.finish), K::callback_end, where, {address(callback, id)});
  }

  static std::uint64_t stamp_of(Time t) { return static_cast<std::uint64_t>(to_ns(t)); }

  const ExportedRun& run_;
  std::vector<tracing::Event> events_;
  const std::shared_ptr<std::unordered_set<std::string>> names_ =
      std::make_shared<std::unordered_set<std::string>>();                        // texts of events
  std::map<std::pair<std::uint32_t, std::string>, std::uint64_t> publisher_of_;   // by node and topic
  std::map<std::pair<TaskId, std::uint64_t>, std::map<TaskId, Time>> published_;  // by job: readers
};

}  // namespace

RunEvents events_of(const ExportedRun& run, bool distinct) { return EventWriter(run).events(distinct); }

}  // namespace hotpath::imports
