// SPDX-License-Identifier: Apache-2.0
#include "import/run_events.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace hotpath {

namespace {

/// Epoch of exported traces, 2001-09-09; the epoch of a run is zero.
constexpr std::int64_t kEpoch_ns = 1'000'000'000'000'000'000;

enum Format : std::uint32_t {
  rcl_init,
  node_init,
  publisher_init,
  subscription_init,
  rclcpp_subscription_init,
  subscription_callback_added,
  callback_register,
  timer_init,
  timer_callback_added,
  timer_link_node,
  callback_start,
  callback_end,
  rclcpp_publish,
  rcl_publish,
  rmw_publish,
  rmw_take,
  rcl_take,
  rclcpp_take,
  get_next_ready,
  wait_for_work,
  execute,
};

std::vector<WrittenFormat> formats() {
  constexpr auto a = FieldType::address, i = FieldType::integer, t = FieldType::text;
  return {
      {"ros2:rcl_init", {{"context_handle", a}, {"version", t}}},
      {"ros2:rcl_node_init", {{"node_handle", a}, {"rmw_handle", a}, {"node_name", t}, {"namespace", t}}},
      {"ros2:rcl_publisher_init",
       {{"publisher_handle", a},
        {"node_handle", a},
        {"rmw_publisher_handle", a},
        {"topic_name", t},
        {"queue_depth", a}}},
      {"ros2:rcl_subscription_init",
       {{"subscription_handle", a},
        {"node_handle", a},
        {"rmw_subscription_handle", a},
        {"topic_name", t},
        {"queue_depth", a}}},
      {"ros2:rclcpp_subscription_init", {{"subscription_handle", a}, {"subscription", a}}},
      {"ros2:rclcpp_subscription_callback_added", {{"subscription", a}, {"callback", a}}},
      {"ros2:rclcpp_callback_register", {{"callback", a}, {"symbol", t}}},
      {"ros2:rcl_timer_init", {{"timer_handle", a}, {"period", i}}},
      {"ros2:rclcpp_timer_callback_added", {{"timer_handle", a}, {"callback", a}}},
      {"ros2:rclcpp_timer_link_node", {{"timer_handle", a}, {"node_handle", a}}},
      {"ros2:callback_start", {{"callback", a}, {"is_intra_process", i}}},
      {"ros2:callback_end", {{"callback", a}}},
      {"ros2:rclcpp_publish", {{"message", a}}},
      {"ros2:rcl_publish", {{"publisher_handle", a}, {"message", a}}},
      {"ros2:rmw_publish", {{"publisher_handle", a}, {"message", a}, {"timestamp", i}}},
      {"ros2:rmw_take",
       {{"rmw_subscription_handle", a}, {"message", a}, {"source_timestamp", i}, {"taken", i}}},
      {"ros2:rcl_take", {{"message", a}}},
      {"ros2:rclcpp_take", {{"message", a}}},
      {"ros2:rclcpp_executor_get_next_ready", {}},
      {"ros2:rclcpp_executor_wait_for_work", {{"timeout", i}}},
      {"ros2:rclcpp_executor_execute", {{"handle", a}}},
  };
}

/// Addresses by kind of entity and index.
enum Kind : std::uint64_t {
  node = 1,
  publisher,
  rmw_publisher,
  subscription,
  rmw_subscription,
  rclcpp_subscription,
  timer,
  callback
};
std::uint64_t address(Kind kind, std::uint64_t index) {
  return (std::uint64_t{kind} << 32) + 16 * (index + 1);
}
constexpr std::uint64_t kMessage = std::uint64_t{9} << 32;

class EventWriter {
 public:
  explicit EventWriter(const ExportedRun& run) : run_(run) {
    written_.formats = formats();
    written_.process_name = "hotpath";
  }

  WrittenTrace events() {
    find_publications();
    initialise();
    add_jobs();
    std::ranges::stable_sort(written_.events, {}, &WrittenEvent::at_ns);
    separate_processors();
    return std::move(written_);
  }

 private:
  struct Where {
    std::uint32_t process = 0, thread = 0;
    std::uint16_t processor = 0;
  };

  /// Ids of threads are unique in a system.
  static Where main_thread(std::uint16_t process) { return {1000U * (1U + process), 1000U * (1U + process)}; }

  /// Readers merge the streams of processors by time alone. Events of two processors at one instant
  /// of virtual time get a nanosecond of distance, in the order of cause and effect.
  void separate_processors() {
    const WrittenEvent* last = nullptr;
    for (WrittenEvent& e : written_.events) {
      if (last != nullptr && e.at_ns <= last->at_ns) {
        e.at_ns = last->at_ns + (e.processor == last->processor ? 0 : 1);
      }
      last = &e;
    }
  }

  std::uint64_t text(const std::string& words) {
    const auto [at, is_new] = texts_.try_emplace(words, written_.texts.size());
    if (is_new) written_.texts.push_back(words);
    return at->second;
  }

  void add(std::int64_t at_ns, Format format, const Where& where, std::array<std::uint64_t, 5> values = {}) {
    written_.events.push_back({at_ns, format, where.processor, where.process, where.thread, values});
  }

  /// The ROS name of a topic.
  static std::string ros_name(const std::string& name) { return "/" + name; }

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
    const std::int64_t begin = kEpoch_ns + earliest.count() - 1'000'000;
    std::uint64_t publishers = 0;
    for (std::uint32_t n = 0; n < run_.graph.nodes.size(); ++n) {
      const Where where = main_thread(process_of[n]);
      if (processes.insert(process_of[n]).second)
        add(begin, rcl_init, where, {1, text(run_.jazzy ? "9.2.0" : "8.0.0")});
      const Node& of = run_.graph.nodes[n];
      add(begin, node_init, where, {address(node, n), address(node, n) + 8, text(of.name), text("/")});
      for (const std::string& topic : of.outputs) {
        publisher_of_[{n, topic}] = publishers;
        add(begin, publisher_init, where,
            {address(publisher, publishers), address(node, n), address(rmw_publisher, publishers),
             text(ros_name(topic)), 10});
        ++publishers;
      }
    }
    for (TaskId id = 0; id < run_.tasks.set.size(); ++id) initialise(id, begin, process_of);
  }

  void initialise(TaskId id, std::int64_t begin, const std::map<std::uint32_t, std::uint16_t>& process_of) {
    const TaskOrigin& origin = run_.tasks.origin[id];
    const Task& task = run_.tasks.set[id];
    const Where where = main_thread(process_of.at(origin.node));
    if (origin.input) {
      const Input& input = run_.graph.nodes[origin.node].inputs[*origin.input];
      add(begin, subscription_init, where,
          {address(subscription, id), address(node, origin.node), address(rmw_subscription, id),
           text(ros_name(input.topic)), input.depth});
      add(begin, rclcpp_subscription_init, where,
          {address(subscription, id), address(rclcpp_subscription, id)});
      add(begin, subscription_callback_added, where,
          {address(rclcpp_subscription, id), address(callback, id)});
      add(begin, callback_register, where, {address(callback, id), text(task.name)});
      return;
    }
    const std::int64_t created = kEpoch_ns + (task.phase - task.period).count();
    add(created, timer_init, where, {address(timer, id), static_cast<std::uint64_t>(task.period.count())});
    add(created, timer_callback_added, where, {address(timer, id), address(callback, id)});
    add(created, callback_register, where, {address(callback, id), text(task.name)});
    add(created, timer_link_node, where, {address(timer, id), address(node, origin.node)});
  }

  /// Adds jobs in the order of starts: at one instant the events of an earlier job come first.
  void add_jobs() {
    std::vector<const JobRecord*> jobs;
    for (const JobRecord& r : run_.trace.jobs)
      if (started(r)) jobs.push_back(&r);
    std::ranges::stable_sort(jobs, {}, [](const JobRecord* r) {
      return std::pair(r->start, r->outcome == Outcome::ran ? r->finish : Time::max());
    });
    std::map<std::pair<std::uint16_t, std::uint16_t>, const JobRecord*> previous;  // by process and worker
    for (const JobRecord* r : jobs) {
      Where where = main_thread(r->process);
      where.thread += r->worker;
      where.processor =
          static_cast<std::uint16_t>(r->cpu >= 0 ? r->cpu : static_cast<int>(r->worker % run_.cores));
      const JobRecord*& before = previous[{r->process, r->worker}];
      if (r->worker < run_.polled.size() && run_.polled[r->worker]) add_executor_events(*r, before, where);
      before = r;
      add_job(*r, where);
    }
  }

  std::int64_t ns(Time t) const { return kEpoch_ns + (t - run_.trace.epoch).count(); }

  /// A job that became ready after the start of the previous one needed another wait.
  void add_executor_events(const JobRecord& r, const JobRecord* before, const Where& where) {
    const std::int64_t at =
        before == nullptr || before->finish < before->start ? ns(r.start) : ns(before->finish);
    if (before == nullptr || r.job.release > before->start)
      add(at, wait_for_work, where, {static_cast<std::uint64_t>(-1)});
    add(ns(r.start), get_next_ready, where);
    add(ns(r.start), execute, where,
        {address(run_.tasks.origin[r.job.task].input ? subscription : timer, r.job.task)});
  }

  void add_job(const JobRecord& r, const Where& where) {
    const TaskId id = r.job.task;
    if (run_.tasks.origin[id].input) {
      add(ns(r.start), rmw_take, where,
          {address(rmw_subscription, id), kMessage, static_cast<std::uint64_t>(ns(r.job.timestamp)), 1});
      add(ns(r.start), rcl_take, where, {kMessage});
      add(ns(r.start), rclcpp_take, where, {kMessage});
    }
    add(ns(r.start), callback_start, where, {address(callback, id), 0});
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
      if (publishes)
        add_publication(ns(at), publisher_of_.at({run_.tasks.origin[id].node, publication.topic}), where);
    }
    add(ns(r.finish), callback_end, where, {address(callback, id)});
  }

  void add_publication(std::int64_t at, std::uint64_t of, const Where& where) {
    add(at, rclcpp_publish, where, {kMessage + 8});
    add(at, rcl_publish, where, {address(publisher, of), kMessage + 8});
    add(at, rmw_publish, where, {address(rmw_publisher, of), kMessage + 8, static_cast<std::uint64_t>(at)});
  }

  const ExportedRun& run_;
  WrittenTrace written_;
  std::map<std::string, std::uint64_t> texts_;
  std::map<std::pair<std::uint32_t, std::string>, std::uint64_t> publisher_of_;   // by node and topic
  std::map<std::pair<TaskId, std::uint64_t>, std::map<TaskId, Time>> published_;  // by job: readers
};

}  // namespace

WrittenTrace run_events(const ExportedRun& run) { return EventWriter(run).events(); }

}  // namespace hotpath
