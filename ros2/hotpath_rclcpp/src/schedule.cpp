// SPDX-License-Identifier: Apache-2.0
#include "schedule.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "hotpath/reference_system/ros_names.hpp"
#include "trace_events.hpp"

namespace hotpath {

namespace {

constexpr std::size_t kDeadTasks = 64;  ///< Up to this many dead tasks, rebuilding does not pay.

/// A topic of a graph may omit the namespace.
bool same_topic(const std::string& topic, const std::string& of_graph) {
  return topic == of_graph || topic.ends_with("/" + of_graph);
}

/// Whether the edge from `publisher` to `fed` is already learnt.
bool knows(const Entry& publisher, const std::shared_ptr<Entry>& fed) {
  return std::ranges::any_of(publisher.feeds, [&](const auto& weak) {
    return !weak.owner_before(fed) && !fed.owner_before(weak);  // without counting references, for speed
  });
}

}  // namespace

Schedule::Schedule(Setup setup)
    : setup_(std::move(setup)),
      set_(setup_.tasks.set),
      scheduler_(setup_.executor->make(set_, setup_.scheduler)),
      entries_(set_.size()) {
  scheduler_->begin(Time{});
  trace::executor_init(this, setup_);
}

std::optional<TaskId> Schedule::in_graph(const Entry& entry) const {
  const GraphTasks& tasks = setup_.tasks;
  const Node* const node = find_ros_node(setup_.graph, entry.node);
  if (node == nullptr) return std::nullopt;
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const TaskOrigin& origin = tasks.origin[id];
    if (&setup_.graph.nodes[origin.node] != node) continue;
    if (entry.is_timer() ? !origin.input && tasks.set[id].period == entry.task.period
                         : origin.input && same_topic(entry.topic, node->inputs[*origin.input].topic)) {
      return id;
    }
  }
  return std::nullopt;
}

std::optional<Duration> Schedule::offset_of(const Entry& entry) const {
  const auto ghost = setup_.offsets.empty() ? std::nullopt : in_graph(entry);
  return ghost ? std::optional(setup_.offsets[*ghost]) : std::nullopt;
}

std::optional<std::int64_t> Schedule::priority_of(const Entry& entry) const {
  for (const std::weak_ptr<void>& handle :
       {entry.entity, entry.stands_for, std::weak_ptr<void>(entry.group->group)}) {
    if (const auto found = by_hand_.find(handle); found != by_hand_.end()) return found->second;
  }
  for (const GivenPriority& given : setup_.priorities) {
    if (given.id == entry.id) return given.priority;
  }
  if (const auto ghost = in_graph(entry)) return setup_.tasks.set[*ghost].priority;
  return std::nullopt;
}

std::optional<Duration> Schedule::place_of(const Entry& entry) const {
  const bool service = entry.task.entity == EntityKind::service || entry.task.entity == EntityKind::client;
  if (!service || setup_.executor->traits.policy == Policy::fp) return std::nullopt;
  const auto found = by_hand_.find(entry.entity);
  return found == by_hand_.end() ? std::nullopt : std::optional(Duration(found->second));
}

void Schedule::compute_upstream() {
  if (!std::exchange(stale_, false)) return;
  const auto shortest = [this](Policy policy, Duration Task::*member) {
    std::vector<Duration> values;
    for (const TaskId timer : most_urgent_timers(set_, policy)) {
      values.push_back(timer == kNoTask || set_[timer].always_due ? Duration{} : set_[timer].*member);
    }
    return values;
  };
  periods_ = shortest(Policy::rm, &Task::period);
  deadlines_ = shortest(Policy::dm, &Task::deadline);
}

Duration Schedule::period_of(TaskId task) {
  compute_upstream();
  return task < periods_.size() ? periods_[task] : Duration{};
}

Time Schedule::deadline_of(const Entry& entry, Time inherited, Time now) {
  if (!by_deadline(traits_of(setup_.executor->traits.queue_order()).levels)) return inherited;
  if (const auto place = place_of(entry)) return now + *place;
  if (inherited != kNever) return inherited;
  compute_upstream();
  const Duration deadline = deadlines_[entry.number];
  return deadline > Duration::zero() ? now + deadline : kNever;
}

void Schedule::give_place(const std::shared_ptr<Entry>& entry, Time now) {
  const auto place = place_of(*entry);
  if (!place || entry->number == kNoTask) return;
  if (entry->ghost != kNoTask) drop(entry->ghost, now);
  JoiningTask ghost;
  ghost.task.kind = TaskKind::timer;
  ghost.task.local = false;
  ghost.task.period = ghost.task.deadline = *place;
  ghost.task.feeds = {entry->number};
  entry->ghost = add(ghost, now, entry).task;
}

std::vector<TaskId> Schedule::feeds_of(const Entry& entry) const {
  std::vector<TaskId> feeds;
  for (const std::weak_ptr<Entry>& weak : entry.feeds) {
    const auto fed = weak.lock();
    if (fed && fed->number != kNoTask && !place_of(*fed)) feeds.push_back(fed->number);
  }
  return feeds;
}

std::vector<TaskId> Schedule::feeders_of(const std::shared_ptr<Entry>& entry) const {
  std::vector<TaskId> feeders;
  if (const auto ghost = in_graph(*entry)) {
    for (TaskId id = 0; id < setup_.tasks.set.size(); ++id) {
      if (std::ranges::count(setup_.tasks.set[id].feeds, *ghost) > 0) feeders.push_back(id);
    }
  }
  for (const std::shared_ptr<Entry>& other : living()) {
    if (knows(*other, entry) && !place_of(*entry)) feeders.push_back(other->number);
  }
  return feeders;
}

Joined Schedule::add(JoiningTask joining, Time now, std::shared_ptr<Entry> entry) {
  stale_ = true;
  joining.new_group = entry->group->kind;
  Group& group = *entry->group;
  if (std::exchange(group.generation, generation_) != generation_) {
    group.index = static_cast<std::uint32_t>(set_.groups.size());
  }
  joining.task.group = group.index;
  hotpath::join(set_, joining);
  if (joining.task.local) ++alive_;
  entries_.push_back(joining.task.local ? std::move(entry) : nullptr);
  return scheduler_->add_task(joining, now);
}

WorkerSet Schedule::join(const std::shared_ptr<Entry>& entry, Time first, Time now) {
  entry->joined = now;
  JoiningTask joining;
  joining.task = entry->task;
  joining.task.priority = priority_of(*entry);
  joining.task.feeds = feeds_of(*entry);
  joining.fed_by = feeders_of(entry);
  if (entry->is_timer()) {
    const auto ghost = in_graph(*entry);
    joining.task.deadline = ghost ? setup_.tasks.set[*ghost].deadline : joining.task.period;
    entry->task.deadline = joining.task.deadline;
    joining.task.phase = first - now;
    entry->next_release = first;
  }
  if (entry->clock == TimerClock::simulated) {
    // Ticks of simulated time release the timer like samples. A non-local timer task, the ghost,
    // gives it its priority.
    JoiningTask ghost = joining;
    ghost.task.local = false;
    ghost.task.feeds.clear();
    entry->ghost = add(ghost, now, entry).task;
    joining.task.kind = TaskKind::subscription;
    joining.task.period = joining.task.phase = {};
    joining.fed_by = {entry->ghost};
  }
  const Joined joined = add(joining, now, entry);
  entry->number = joined.task;
  give_place(entry, now);
  trace::executor_callback(this, *entry);
  trace_priorities();
  return joined.wake;
}

std::size_t Schedule::drop(TaskId task, Time now) {
  std::size_t jobs = 0;
  stale_ = true;
  hotpath::leave(set_, task);
  if (std::exchange(entries_[task], nullptr)) --alive_;
  scheduler_->remove_task(task, now, [&](const Job&, Outcome) { ++jobs; });
  return jobs;
}

std::size_t Schedule::leave(Entry& entry, Time now) {
  if (entry.number == kNoTask) return 0;
  std::size_t dropped = drop(std::exchange(entry.number, kNoTask), now);
  if (entry.ghost != kNoTask) dropped += drop(std::exchange(entry.ghost, kNoTask), now);
  entry.pending = false;
  entry.events = 0;
  return dropped;
}

std::vector<std::shared_ptr<Entry>> Schedule::living() const {
  std::vector<std::shared_ptr<Entry>> all;
  std::ranges::copy_if(entries_, std::back_inserter(all), [](const auto& e) { return e != nullptr; });
  return all;
}

std::size_t Schedule::queued(Time now) const {
  std::size_t jobs = 0;
  scheduler_->unfinished(now, [&](const Job& job, Outcome) {
    if (set_[job.task].kind == TaskKind::timer) ++jobs;
  });
  for (const std::shared_ptr<Entry>& entry : entries_) jobs += entry ? entry->events : 0;
  return jobs;
}

void Schedule::for_each_waiting(
    Time now, const std::function<void(const std::shared_ptr<Entry>&, Duration)>& visit) const {
  scheduler_->unfinished(now, [&](const Job& job, Outcome outcome) {
    const std::shared_ptr<Entry>& entry = entries_[job.task];
    if (entry && outcome == Outcome::queued) visit(entry, now - std::max(job.timestamp, entry->joined));
  });
}

bool Schedule::compact(Time now) {
  const std::size_t dead = entries_.size() - setup_.tasks.set.size() - alive_;
  if (dead < kDeadTasks + alive_ || queued(now) > 0) return false;
  const std::vector<std::shared_ptr<Entry>> entries = living();
  for (const std::shared_ptr<Entry>& entry : entries) entry->number = entry->ghost = kNoTask;
  ++generation_;
  stale_ = true;
  traced_.clear();
  set_ = setup_.tasks.set;
  entries_.assign(set_.size(), nullptr);
  alive_ = 0;
  scheduler_ = setup_.executor->make(set_, setup_.scheduler);
  scheduler_->begin(now);
  for (const std::shared_ptr<Entry>& entry : entries) join(entry, entry->next_release, now);
  return true;
}

void Schedule::change(const Entry& entry) {
  stale_ = true;
  Task& task = set_.tasks[entry.number];
  task.priority = priority_of(entry);
  task.feeds = feeds_of(entry);
  scheduler_->change_task(entry.number, task.priority, task.feeds);
}

bool Schedule::learn(TaskId from, const std::shared_ptr<Entry>& to) {
  if (!setup_.learn || from >= entries_.size() || !entries_[from]) return false;
  Entry& publisher = *entries_[from];
  if (knows(publisher, to)) return false;
  std::erase_if(publisher.feeds, [](const auto& fed) { return fed.expired(); });
  publisher.feeds.push_back(to);
  change(publisher);
  trace_priorities();
  return true;
}

void Schedule::set_priority(const std::shared_ptr<void>& entity, std::int64_t priority, bool service,
                            Time now) {
  const Policy policy = setup_.executor->traits.queue_order();
  const std::string error = "set_priority: executor `" + setup_.name + "` ";
  if (traits_of(policy).levels == Levels::arrival) {
    throw std::invalid_argument(error +
                                "runs callbacks by arrival; only the paper's executors take priorities");
  }
  if (policy != Policy::fp && !service) {
    throw std::invalid_argument(error +
                                "computes the order of timers and subscriptions; only fp-ro and fp-re " +
                                "take their priorities");
  }
  if (policy != Policy::fp && priority <= 0) {
    throw std::invalid_argument(error +
                                "takes the priority of a service or client as a period or deadline in " +
                                "ns, > 0, not " + std::to_string(priority));
  }
  std::erase_if(by_hand_, [](const auto& given) { return given.first.expired(); });
  by_hand_[entity] = priority;
  for (const std::shared_ptr<Entry>& entry : living()) {
    if (entry->number == kNoTask) continue;
    change(*entry);
    if (entry->entity.lock() == entity) give_place(entry, now);
  }
  trace_priorities();
}

void Schedule::trace_priorities() {
  const Policy policy = setup_.executor->traits.queue_order();
  if (traits_of(policy).levels != Levels::fixed || !trace::priorities_are_recorded()) return;
  const std::vector<std::int64_t> levels = inherited_levels(set_, policy);
  traced_.resize(levels.size());
  for (const std::shared_ptr<Entry>& entry : living()) {
    const TaskId task = entry->number;
    if (task == kNoTask || std::exchange(traced_[task], levels[task]) == levels[task]) continue;
    trace::executor_priority(this, task, levels[task]);
  }
}

std::vector<std::string> Schedule::order() const {
  const Policy policy = setup_.executor->traits.queue_order();
  const std::vector<std::int64_t> levels = inherited_levels(set_, policy);
  std::vector<std::shared_ptr<Entry>> entries = living();
  const auto level = [&](const std::shared_ptr<Entry>& e) { return levels[e->number]; };
  const bool fixed = traits_of(policy).levels == Levels::fixed;
  if (fixed) std::ranges::stable_sort(entries, {}, level);
  std::vector<std::string> texts;
  for (const std::shared_ptr<Entry>& e : entries) {
    std::string by = by_deadline(traits_of(policy).levels) ? "by deadline" : "by arrival";
    if (fixed && level(e) == std::numeric_limits<std::int64_t>::max())
      by = "last";
    else if (policy == Policy::fp)
      by = std::to_string(level(e));
    else if (fixed)
      by = std::to_string(level(e)) + " ns";
    texts.push_back(e->id + ": " + by);
  }
  return texts;
}

bool Schedule::runs_last(const Entry& entry) const {
  const Policy policy = setup_.executor->traits.queue_order();
  if (entry.number == kNoTask || traits_of(policy).levels == Levels::arrival) return false;
  if (setup_.scheduler.rule == SubscriptionRule::first) return false;
  if (by_deadline(traits_of(policy).levels)) return most_urgent_timers(set_, policy)[entry.number] == kNoTask;
  return inherited_levels(set_, policy)[entry.number] == std::numeric_limits<std::int64_t>::max();
}

bool Schedule::lacks_priorities() const {
  return setup_.executor->traits.policy == Policy::fp && by_hand_.empty() && setup_.priorities.empty() &&
         std::ranges::none_of(setup_.tasks.set.tasks,
                              [](const Task& task) { return task.priority.has_value(); });
}

std::vector<std::string> Schedule::unmatched() const {
  std::vector<std::string> known, nodes, said;
  for (const std::shared_ptr<Entry>& entry : living()) {
    known.push_back(entry->id);
    nodes.push_back(entry->node);
  }
  for (const GivenPriority& given : setup_.priorities) {
    if (std::ranges::count(known, given.id) == 0) {
      said.push_back(no_such_callback(setup_.priorities_file, given, known));
    }
  }
  const auto met = [&](const std::string& node) { return find_ros_node(setup_.graph, node) != nullptr; };
  if (!setup_.graph.nodes.empty() && !nodes.empty() && std::ranges::none_of(nodes, met)) {
    said.push_back(no_such_nodes(setup_.graph, nodes));
  }
  return said;
}

}  // namespace hotpath
