// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_system.hpp"

#include <map>
#include <numeric>
#include <set>

#include "hotpath/core/worker.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::CallbackKind;

/// Share of requests that a caller must explain, and of its jobs that must have sent one.
constexpr double kExplained = 0.9;

/// The kinds of callbacks of a thread, and their nodes.
struct ThreadUse {
  bool timers = false, others = false;
  std::set<std::uint32_t> nodes;
};

/// Services and clients do not define executors; their threads may serve none.
bool defines_executor(const tracing::Callback& callback) {
  const bool is_task = callback.kind == CallbackKind::timer || callback.kind == CallbackKind::subscription;
  return is_task && callback.node != kNone && !callback.threads.empty();
}

std::vector<ThreadUse> uses_of(const tracing::System& system) {
  std::vector<ThreadUse> uses(system.threads.size());
  for (const tracing::Callback& callback : system.callbacks) {
    if (!defines_executor(callback)) continue;
    for (const auto& [thread, jobs] : callback.threads) {
      (callback.kind == CallbackKind::timer ? uses[thread].timers : uses[thread].others) = true;
      uses[thread].nodes.insert(callback.node);
    }
  }
  return uses;
}

/// Release-and-execute: a thread with timers only serves the same nodes as the other thread, or
/// both are the only ones of their process.
bool has_timers_of(std::uint32_t timers, std::uint32_t others, const tracing::System& system,
                   const std::vector<ThreadUse>& uses) {
  const ThreadUse &a = uses[timers], &b = uses[others];
  const bool apart = a.timers && !a.others && b.others && !b.timers;
  if (!apart || system.threads[timers].waits + system.threads[others].waits > 0) return false;
  const auto shared = [&](std::uint32_t node) { return b.nodes.contains(node); };
  if (std::ranges::any_of(a.nodes, shared)) return true;
  const std::uint32_t process = system.threads[timers].process;
  int of_process = 0;
  for (std::uint32_t t = 0; t < uses.size(); ++t)
    of_process += system.threads[t].process == process && !uses[t].nodes.empty();
  return process == system.threads[others].process && of_process == 2;
}

/// A request and the job that may have sent it: indices into the jobs.
using Match = std::pair<std::size_t, std::size_t>;

struct Caller {
  std::uint32_t callback = kNone;
  std::size_t jobs = 0;
  std::vector<Match> matches;
  tracing::Duration delays{};  ///< Sum from the ends of its jobs to the starts of the service's.

  [[nodiscard]] bool explains(std::size_t requests) const {
    return static_cast<double>(matches.size()) >= kExplained * static_cast<double>(std::max(requests, jobs));
  }
};

/// Each job of the service takes the latest job of the candidate that ended before it, unless an
/// earlier one has.
Caller matched(const std::vector<tracing::Job>& jobs, const std::vector<std::size_t>& served,
               std::uint32_t callback, const std::vector<std::size_t>& sent) {
  Caller caller{callback, sent.size(), {}, {}};
  std::size_t next = 0;
  for (const std::size_t request : served) {
    const std::size_t first = next;
    while (next < sent.size() && jobs[sent[next]].finish <= jobs[request].start) ++next;
    if (next == first) continue;
    caller.matches.emplace_back(request, sent[next - 1]);
    caller.delays += jobs[request].start - jobs[sent[next - 1]].finish;
  }
  return caller;
}

std::vector<std::string> unseen_callbacks(const tracing::System& system,
                                          const std::vector<RecordedExecutor>& executors) {
  const auto waits = [&](std::uint32_t thread) { return system.threads[thread].waits > 0; };
  const auto is_unseen = [&](const RecordedExecutor& executor) {
    const auto states_ends = [&](const tracing::StatedExecutor& stated) {
      return stated.states_ends && executor.is(stated);
    };
    return std::ranges::count(system.clients, executor.process, &tracing::ServiceClient::process) > 0 &&
           std::ranges::none_of(executor.threads, waits) &&
           std::ranges::none_of(system.stated_executors, states_ends);
  };
  std::vector<std::string> notes;
  if (std::ranges::any_of(executors, is_unseen))
    notes.push_back(
        "An executor writes no events of callbacks of clients, actions and other waitables; what they ran is "
        "missing in the graph.");
  if (system.unclear_callbacks > 0 && !system.clients.empty())
    notes.push_back(
        "Several threads of a process wait for work: callbacks of clients and waitables, which have no "
        "events, cannot be told from waiting for another thread and are missing in the graph.");
  return notes;
}

/// The number of processors that the threads usually ran on, in [1, kMaxWorkers].
unsigned cores_of(const tracing::System& system) {
  std::set<std::int32_t> processors;
  for (const tracing::Thread& t : system.threads)
    for (const std::int32_t processor : usual_processors(t)) processors.insert(processor);
  return static_cast<unsigned>(std::clamp<std::size_t>(processors.size(), 1, kMaxWorkers));
}

}  // namespace

RecordedSystem recorded_system(tracing::System system, std::vector<tracing::Job> jobs,
                               std::vector<tracing::LostSample> lost, unsigned cores) {
  std::ranges::sort(jobs, {}, &tracing::Job::started);
  const tracing::Time last = jobs.back().ended ? jobs.back().finish : jobs.back().start;
  std::vector<std::string> notes = attribute_requests(system, jobs);
  std::vector<RecordedExecutor> executors = recorded_executors(system);
  std::ranges::move(unseen_callbacks(system, executors), std::back_inserter(notes));
  std::vector<std::uint32_t> executor_of(system.callbacks.size(), kNone);
  for (std::uint32_t c = 0; c < executor_of.size(); ++c) {
    for (const auto& [thread, count] : system.callbacks[c].threads) {
      const auto has = [t = thread](const RecordedExecutor& executor) { return executor.has(t); };
      const auto of = std::ranges::find_if(executors, has);
      if (system.callbacks[c].node == kNone || of == executors.end()) continue;
      executor_of[c] = static_cast<std::uint32_t>(of - executors.begin());
      break;
    }
  }
  return {.jobs = std::move(jobs),
          .lost = std::move(lost),
          .executors = std::move(executors),
          .executor_of = std::move(executor_of),
          .cores = cores > 0 ? cores : cores_of(system),
          .end = last + tracing::Duration(1),
          .notes = std::move(notes),
          .system = std::move(system)};
}

RecordedSystem RecordedSystem::beginning(std::size_t count) const {
  RecordedSystem few = *this;
  few.end = jobs[count].start;
  few.jobs.resize(count);
  for (tracing::Job& job : few.jobs) {
    if (!job.ended || job.finish < few.end) continue;
    job.ended = false;
    std::erase_if(job.published, [&](const tracing::Publication& p) { return p.at >= few.end; });
  }
  std::erase_if(few.lost, [&](const tracing::LostSample& l) { return l.sample.published >= few.end; });
  return few;
}

std::vector<RecordedExecutor> recorded_executors(const tracing::System& system) {
  const std::vector<ThreadUse> uses = uses_of(system);
  std::vector<std::uint32_t> number_of(uses.size());  // by thread: threads of one executor have one number
  std::iota(number_of.begin(), number_of.end(), 0U);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    std::ranges::replace(number_of, std::uint32_t{number_of[b]}, std::uint32_t{number_of[a]});
  };
  for (const tracing::Callback& callback : system.callbacks)
    if (defines_executor(callback))
      for (const auto& [thread, jobs] : callback.threads) join(callback.threads.begin()->first, thread);
  for (std::uint32_t a = 0; a < uses.size(); ++a)
    for (std::uint32_t b = 0; b < uses.size(); ++b)
      if (has_timers_of(a, b, system, uses)) join(b, a);
  std::vector<RecordedExecutor> executors;
  std::map<std::uint32_t, std::size_t> index;
  for (std::uint32_t t = 0; t < uses.size(); ++t) {
    if (uses[t].nodes.empty()) continue;
    const auto [at, is_new] = index.try_emplace(number_of[t], executors.size());
    if (is_new) {
      // Processes of different containers may have threads with equal ids.
      const tracing::Thread& first = system.threads[t];
      const bool several = system.processes.size() > 1;
      const std::string prefix = several ? program::concat("process_", first.process, "_") : "";
      executors.push_back({program::concat(prefix, "thread_", first.id), first.process, {}});
    }
    executors[at->second].threads.push_back(t);
  }
  return executors;
}

std::vector<std::int32_t> usual_processors(const tracing::Thread& thread) {
  std::vector<std::int32_t> usual;
  for (const auto& [processor, jobs] : thread.processors)
    if (100 * jobs >= thread.jobs) usual.push_back(processor);
  return usual;
}

std::vector<std::string> attribute_requests(const tracing::System& system, std::vector<tracing::Job>& jobs) {
  std::map<std::uint32_t, std::set<std::uint32_t>> client_nodes;  // by service
  for (const tracing::ServiceClient& client : system.clients)
    if (client.node != kNone) client_nodes[client.service].insert(client.node);
  std::vector<std::vector<std::size_t>> jobs_of(system.callbacks.size());
  for (std::size_t j = 0; j < jobs.size(); ++j)
    if (jobs[j].ended && jobs[j].ref.callback < jobs_of.size()) jobs_of[jobs[j].ref.callback].push_back(j);
  std::vector<std::string> notes;
  for (std::uint32_t s = 0; s < jobs_of.size(); ++s) {
    const tracing::Callback& service = system.callbacks[s];
    if (service.kind != CallbackKind::service || jobs_of[s].empty()) continue;
    Caller best;
    for (std::uint32_t c = 0; c < jobs_of.size(); ++c) {
      const std::uint32_t node = system.callbacks[c].node;
      if (c == s || !client_nodes[service.topic].contains(node) || jobs_of[c].empty()) continue;
      Caller caller = matched(jobs, jobs_of[s], c, jobs_of[c]);
      if (!caller.explains(jobs_of[s].size())) continue;
      if (best.callback == kNone || caller.delays < best.delays) best = std::move(caller);
    }
    if (best.callback == kNone) continue;
    for (const auto& [request, sender] : best.matches) {
      tracing::Job& sent = jobs[sender];
      sent.published.push_back({service.topic, sent.finish, sent.finished});
      jobs[request].sample.published = sent.finish;
      jobs[request].sample.parent = sent.ref;
    }
    notes.push_back(program::concat("A trace does not show who calls a service: node ",
                                    system.nodes[system.callbacks[best.callback].node],
                                    " is taken to send the requests to ", system.topics[service.topic].name,
                                    ", which follow ", best.matches.size(), " of ", best.jobs,
                                    " jobs of one of its callbacks."));
  }
  return notes;
}

}  // namespace hotpath::imports
