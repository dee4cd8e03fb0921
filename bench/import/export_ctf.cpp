// SPDX-License-Identifier: Apache-2.0
#include "import/import_ctf.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hotpath/tracing/ctf_trace.hpp"
#include "import/recognition.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::imports {

namespace {

using E = tracing::EventKind;

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

using ThreadId = std::pair<std::uint16_t, std::uint16_t>;  // process and worker
ThreadId thread_of(const JobRecord& r) { return {r.process, r.worker}; }

/// The processors of the jobs, which are in the order of starts. A simulated one gets one on which its thread
/// may run: the last one of its thread or another one without a running job, otherwise one whose running job
/// ends later and is preempted, preferably one whose thread is not bound to it.
std::vector<std::int32_t> processors_of(const ExportedRun& run, const std::vector<const JobRecord*>& jobs) {
  const auto may_move = [&](const JobRecord& r) {
    return r.worker >= run.processors.size() || run.processors[r.worker].size() != 1;
  };
  const auto end_of = [](const JobRecord& r) { return r.outcome == Outcome::ran ? r.finish : Time::max(); };
  std::vector<std::vector<const JobRecord*>> running(run.cores);  // by processor, the innermost last
  std::map<ThreadId, int> last_of;
  const auto choose = [&](const JobRecord& r) {
    int& last = last_of.try_emplace(thread_of(r), static_cast<int>(r.worker % run.cores)).first->second;
    std::vector<int> allowed(run.cores);
    std::iota(allowed.begin(), allowed.end(), 0);
    if (r.worker < run.processors.size() && !run.processors[r.worker].empty())
      allowed = run.processors[r.worker];
    std::erase_if(allowed, [&](int p) { return p >= static_cast<int>(run.cores); });
    if (allowed.empty()) allowed = {last};
    const auto own = std::ranges::find(allowed, last);
    if (own != allowed.end()) std::iter_swap(allowed.begin(), own);
    const auto rank = [&](int p) {
      std::vector<const JobRecord*>& on = running[static_cast<std::size_t>(p)];
      std::erase_if(on, [&](const JobRecord* other) { return end_of(*other) <= r.start; });
      if (on.empty()) return 0;
      const bool ends_later = end_of(*on.back()) >= end_of(r);
      return may_move(*on.back()) ? (ends_later ? 1 : 2) : (ends_later ? 3 : 4);
    };
    last = *std::ranges::min_element(allowed, {}, rank);
    running[static_cast<std::size_t>(last)].push_back(&r);
    return last;
  };
  std::vector<std::size_t> order(jobs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // Those that are bound to a processor choose first at one instant.
  std::ranges::stable_sort(order, {},
                           [&](std::size_t j) { return std::pair(jobs[j]->start, may_move(*jobs[j])); });
  std::vector<std::int32_t> of_job(jobs.size());
  for (const std::size_t j : order) of_job[j] = jobs[j]->cpu >= 0 ? jobs[j]->cpu : choose(*jobs[j]);
  return of_job;
}

class EventWriter {
 public:
  explicit EventWriter(const ExportedRun& run) : run_(run) {}

  RunEvents events(bool distinct) {
    // The publications of each job that a reader received.
    for (const JobRecord& r : run_.trace.jobs)
      if (r.job.parent.task != kNoTask)
        published_[{r.job.parent.task, r.job.parent.sequence}][r.job.task] = r.job.timestamp;
    initialise();
    add_jobs();
    std::ranges::stable_sort(events_, {}, &tracing::Event::at);
    if (distinct) separate_processors();
    return {std::move(events_), names_};
  }

 private:
  /// An event on a process's main thread. Ids of threads are unique in a system.
  static tracing::Event on_main_thread(std::uint16_t process) {
    const std::uint32_t id = 1000U * (1U + process);
    return {.process = id, .thread = id, .processor = 0};
  }

  /// Readers merge the streams of processors by time alone. Events of two processors at one instant
  /// of virtual time get a nanosecond of distance, in the order of cause and effect.
  void separate_processors() {
    for (std::size_t i = 1; i < events_.size(); ++i) {
      const tracing::Event& last = events_[i - 1];
      if (events_[i].at <= last.at)
        events_[i].at = last.at + Duration(events_[i].processor == last.processor ? 0 : 1);
    }
  }

  /// Adds an event on the thread of `where`.
  void add(Time at, E kind, tracing::Event where, const std::array<std::uint64_t, 4>& numbers = {},
           const std::array<const char*, 2>& texts = {"", ""}) {
    events_.push_back({kind, where.process, where.thread, where.processor, at, numbers, texts});
  }

  const char* ros_name(const std::string& topic) { return names_->insert("/" + topic).first->c_str(); }
  [[nodiscard]] const TaskOrigin& origin(TaskId id) const { return run_.tasks.origin[id]; }

  void initialise() {
    std::set<std::uint16_t> processes;
    std::map<std::uint32_t, std::uint16_t> process_of;  // by node
    for (const JobRecord& r : run_.trace.jobs)
      if (r.outcome == Outcome::ran) process_of[origin(r.job.task).node] = r.process;
    Duration earliest{};
    for (const Task& task : run_.tasks.set.tasks) earliest = std::min(earliest, task.phase - task.period);
    const Time begin = kExportedEpoch + earliest - std::chrono::milliseconds(1);
    std::uint64_t publishers = 0;
    for (std::uint32_t n = 0; n < run_.graph.nodes.size(); ++n) {
      const tracing::Event where = on_main_thread(process_of[n]);
      if (processes.insert(process_of[n]).second) {
        add(begin, E::rcl_init, where, {1}, {run_.jazzy ? "8.2.2" : "8.0.0", ""});
        if (std::ranges::count(run_.states_jobs, true) > 0)
          add(begin, E::executor_init, where, {kExecutor}, {"hotpath", ""});
      }
      const Node& of = run_.graph.nodes[n];
      add(begin, E::node_init, where, {address(node, n), address(node, n) + 8}, {of.name.c_str(), "/"});
      for (const std::string& topic : of.outputs) {
        const std::uint64_t number = publishers++;
        publisher_of_[{n, topic}] = number;
        add(begin, E::publisher_init, where,
            {address(publisher, number), address(node, n), address(rmw_publisher, number), 10},
            {ros_name(topic), ""});
      }
    }
    for (const TaskId id : run_.tasks.subscriptions_to_create())
      add_subscription(id, begin, on_main_thread(process_of.at(origin(id).node)));
    for (TaskId id = 0; id < run_.tasks.set.size(); ++id)
      if (!origin(id).input) add_timer(id, on_main_thread(process_of.at(origin(id).node)));
  }

  void add_subscription(TaskId id, Time at, const tracing::Event& where) {
    const std::uint32_t n = origin(id).node;
    const Input& input = run_.graph.nodes[n].inputs[*origin(id).input];
    add(at, E::subscription_init, where,
        {address(subscription, id), address(node, n), address(rmw_subscription, id), input.depth},
        {ros_name(input.topic), ""});
    add(at, E::rclcpp_subscription_init, where,
        {address(subscription, id), address(rclcpp_subscription, id)});
    add(at, E::subscription_callback_added, where, {address(rclcpp_subscription, id), address(callback, id)});
    add(at, E::callback_register, where, {address(callback, id)}, {run_.tasks.set[id].name.c_str(), ""});
  }

  void add_timer(TaskId id, const tracing::Event& where) {
    const Task& task = run_.tasks.set[id];
    const Time at = kExportedEpoch + task.phase - task.period;
    add(at, E::timer_init, where, {address(timer, id), static_cast<std::uint64_t>(task.period.count())});
    add(at, E::timer_callback_added, where, {address(timer, id), address(callback, id)});
    add(at, E::callback_register, where, {address(callback, id)}, {task.name.c_str(), ""});
    add(at, E::timer_link_node, where, {address(timer, id), address(node, origin(id).node)});
  }

  /// Adds jobs in the order of starts. At one instant they have the order of the trace: a job of another
  /// thread that ends at once may publish what this one did not find yet.
  void add_jobs() {
    std::vector<const JobRecord*> jobs;
    for (const JobRecord& r : run_.trace.jobs)
      if (r.started()) jobs.push_back(&r);
    std::ranges::stable_sort(jobs, {}, &JobRecord::start);
    const std::vector<std::int32_t> processors = processors_of(run_, jobs);
    std::map<ThreadId, const JobRecord*> previous;
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const JobRecord& r = *jobs[j];
      tracing::Event where = on_main_thread(r.process);
      where.thread += r.worker;
      where.processor = processors[j];
      const JobRecord* const before = std::exchange(previous[thread_of(r)], &r);
      if (r.worker < run_.polled.size() && run_.polled[r.worker]) add_executor_events(r, before, where);
      add_job(r, where);
    }
  }

  Time traced(Time t) const { return kExportedEpoch + (t - run_.trace.epoch); }
  /// The same as a number of an event.
  std::uint64_t stamp_of(Time t) const { return static_cast<std::uint64_t>(to_ns(traced(t))); }

  /// A job that became ready after the start of the previous one needed another wait.
  void add_executor_events(const JobRecord& r, const JobRecord* before, const tracing::Event& where) {
    const Time start = traced(r.start);
    const bool idle = before == nullptr || before->finish < before->start;
    if (before == nullptr || r.job.release > before->start)
      add(idle ? start : traced(before->finish), E::wait_for_work, where, {static_cast<std::uint64_t>(-1)});
    add(start, E::get_next_ready, where);
    add(start, E::execute, where, {address(origin(r.job.task).input ? subscription : timer, r.job.task)});
  }

  void add_job(const JobRecord& r, const tracing::Event& where) {
    const TaskId id = r.job.task;
    const Time start = traced(r.start);
    if (origin(id).input) {
      add(start, E::rmw_take, where, {address(rmw_subscription, id), kMessage, stamp_of(r.job.timestamp), 1});
      add(start, E::rcl_take, where, {kMessage});
      add(start, E::rclcpp_take, where, {kMessage});
    }
    if (r.worker < run_.states_jobs.size() && run_.states_jobs[r.worker])
      add(start, E::executor_job, where, {kExecutor, id, stamp_of(r.job.timestamp), stamp_of(r.job.release)});
    add(start, E::callback_start, where, {address(callback, id)});
    if (r.outcome != Outcome::ran) return;
    for (std::size_t p = 0; p < run_.tasks.readers[id].size(); ++p) {
      const std::optional<Time> at = publication_of(r, p);
      if (!at) continue;
      const std::string& topic = run_.tasks.callbacks[id].publishes[p].topic;
      const std::uint64_t of = publisher_of_.at({origin(id).node, topic});
      add(traced(*at), E::rclcpp_publish, where, {kMessage + 8});
      add(traced(*at), E::rcl_publish, where, {address(publisher, of), kMessage + 8});
      add(traced(*at), E::rmw_publish, where, {address(rmw_publisher, of), kMessage + 8, stamp_of(*at)});
    }
    add(traced(r.finish), E::callback_end, where, {address(callback, id)});
  }

  /// When a job published its callback's publication `p`: when the first reader received it. Without readers
  /// only the rule tells. std::nullopt: it did not.
  std::optional<Time> publication_of(const JobRecord& r, std::size_t p) const {
    const std::vector<TaskId>& readers = run_.tasks.readers[r.job.task][p];
    const PublishRule rule = run_.tasks.callbacks[r.job.task].publishes[p].rule;
    const bool always = rule == PublishRule::always || rule == PublishRule::last_of;
    if (readers.empty()) return always ? std::optional(r.finish) : std::nullopt;
    const auto received = published_.find({r.job.task, r.job.sequence});
    std::optional<Time> first;
    for (const TaskId reader : readers)
      if (received != published_.end() && received->second.contains(reader))
        first = std::min(first.value_or(r.finish), received->second.at(reader));
    return first;
  }

  const ExportedRun& run_;
  std::vector<tracing::Event> events_;
  const std::shared_ptr<std::unordered_set<std::string>> names_ =
      std::make_shared<std::unordered_set<std::string>>();                        // texts of events
  std::map<std::pair<std::uint32_t, std::string>, std::uint64_t> publisher_of_;   // by node and topic
  std::map<std::pair<TaskId, std::uint64_t>, std::map<TaskId, Time>> published_;  // by job: readers
};

namespace fs = std::filesystem;
/// An executor that rclcpp has from Jazzy on.
bool is_jazzy(const setup::ExecutorSpec& executor) {
  const auto& on_rclcpp = executor.entry->traits.on_rclcpp;
  return on_rclcpp && on_rclcpp->first >= RosDistro::jazzy;
}

/// Sets what rclcpp's events say of each thread. A deployment numbers its threads executor by
/// executor; in a simulation only the deployment knows their processes.
void set_threads(const setup::ExecutorSpec& executor, bool simulated, ExportedRun& exported) {
  exported.jazzy = std::ranges::any_of(setup::parts(executor), is_jazzy);
  if (executor.entry) return exported.polled.assign(kMaxWorkers, emits_waits(executor.entry->traits));
  std::vector<std::uint16_t> processes;
  for (const setup::ExecutorSpec& part : setup::parts(executor)) {
    const std::uint32_t workers = worker_count(*part.entry, part.scheduler);
    exported.polled.insert(exported.polled.end(), workers, emits_waits(part.entry->traits));
    processes.insert(processes.end(), workers, static_cast<std::uint16_t>(part.place.process));
    exported.processors.insert(exported.processors.end(), workers, part.place.processors);
  }
  for (JobRecord& r : exported.trace.jobs) {
    if (simulated && r.worker < processes.size()) r.process = processes[r.worker];
  }
}

/// In a process of its own: babeltrace 2.0 frees memory twice when the disk is full.
void write_ctf(const fs::path& folder, const ExportedRun& exported) {
  program::ForkedTask writer([&] {
    if (std::freopen("/dev/null", "w", stderr) == nullptr) return;
    tracing::write_ctf(folder, events_of(exported, true).events, "hotpath");
  });
  std::string why = writer.wait();
  if (why.empty()) return;
  std::error_code error;
  constexpr std::uintmax_t kFull = 1 << 16;  // bytes
  if (fs::space(folder.parent_path(), error).available < kFull && !error) why = "the disk is full";
  throw program::RunError(program::concat(folder.string(), " cannot be written (", why, ")"));
}

}  // namespace

RunEvents events_of(const ExportedRun& run, bool distinct) { return EventWriter(run).events(distinct); }

void export_ctf(const std::string& folder, const std::string& output) {
  program::check_output_folder(output);
  results::StoredRun run(folder, "RUN");
  const setup::StoredSystem system = setup::stored_system(run);
  run.load(system.tasks.set);
  for (const Trace& trace : run.traces()) {
    const GraphTasks tasks = system.tasks_of(run, trace.executor, trace.repetition);
    ExportedRun exported{system.graph, tasks, trace, {}, {}, {}, false, run.record().cores()};
    run.check([&] { set_threads(system.executor(trace.executor), system.simulated, exported); });
    const bool one = run.traces().size() == 1;
    const fs::path to =
        one ? fs::path(output) : fs::path(output) / program::concat(trace.executor, "-", trace.repetition);
    if (to.has_parent_path()) program::create_folder(to.parent_path());
    program::write_whole_folder(to, [&](const fs::path& part) { write_ctf(part, exported); });
  }
}

}  // namespace hotpath::imports
