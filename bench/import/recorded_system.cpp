// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_system.hpp"

#include <map>
#include <numeric>
#include <set>
#include <tuple>

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

/// A thread with a request to serve does not idle for longer.
constexpr tracing::Duration kServedWithin = std::chrono::milliseconds(1);
/// Requests in fewer of a callback's jobs than in one of two are believed from so many on.
constexpr std::size_t kFewestCalls = 4;

/// A request and the job that may have sent it: indices into the jobs.
using Match = std::pair<std::size_t, std::size_t>;

/// A callback that may have sent the requests, in each n-th job.
struct Caller {
  std::uint32_t callback = kNone;
  std::size_t n = 1, jobs = 0;
  std::vector<Match> matches = {};
  tracing::Duration delays{};  ///< Sum of the distances of its jobs' ends to the starts of the service's.
  bool idled = false;          ///< The service's thread usually idled in between.

  [[nodiscard]] bool explains(std::size_t requests) const {
    return static_cast<double>(matches.size()) >=
               kExplained * static_cast<double>(std::max(requests, jobs)) &&
           (n == 1 || (!idled && requests >= kFewestCalls));
  }
  [[nodiscard]] auto rank() const { return std::tuple(idled, n, delays); }
};

/// How long the thread of a request idled between the end of the job and the request.
tracing::Duration idle_time(const std::vector<tracing::Job>& jobs, const Match& match) {
  const auto& [request, sent] = match;
  const tracing::Time from = jobs[sent].finish;
  tracing::Duration idle = jobs[request].sample.published - from;
  for (std::size_t j = request; j-- > 0 && idle > tracing::Duration{};) {
    if (jobs[j].thread != jobs[request].thread || !jobs[j].ended) continue;
    const tracing::Time end = std::min(jobs[j].finish, jobs[request].sample.published);
    idle -= std::max(tracing::Duration{}, end - std::max(jobs[j].start, from));
    if (jobs[j].start <= from) break;
  }
  return idle;
}

/// Each job of the service takes the latest job of the candidate that began before it, unless an
/// earlier one has. `sent`: the candidate's jobs, of which those from `first` on in steps of n count.
Caller matched(const std::vector<tracing::Job>& jobs, const std::vector<std::size_t>& served,
               const std::vector<std::size_t>& sent, std::size_t first, std::size_t n) {
  Caller caller{jobs[sent.front()].ref.callback, n};
  std::vector<std::size_t> chosen;
  for (std::size_t i = first; i < sent.size(); i += n) chosen.push_back(sent[i]);
  caller.jobs = chosen.size();
  std::size_t next = 0;
  for (const std::size_t request : served) {
    const std::size_t begin = next;
    while (next < chosen.size() && jobs[chosen[next]].start < jobs[request].sample.published) ++next;
    if (next == begin) continue;
    caller.matches.emplace_back(request, chosen[next - 1]);
    caller.delays += std::chrono::abs(jobs[request].start - jobs[chosen[next - 1]].finish);
  }
  const auto idles = [&](const Match& match) { return idle_time(jobs, match) > kServedWithin; };
  caller.idled = 2 * std::ranges::count_if(caller.matches, idles) > std::ssize(caller.matches);
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
  const bool unseen_client = std::ranges::count(system.clients, kNone, &tracing::ServiceClient::callback) > 0;
  if (system.unclear_callbacks > 0 && unseen_client)
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
  std::vector<std::string> missing = unseen_callbacks(system, executors);
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
          .missing = std::move(missing),
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

Overlaps overlaps_of(const RecordedSystem& recorded, const std::vector<bool>& is_task) {
  Overlaps result{std::vector<bool>(is_task.size()), std::vector<bool>(is_task.size())};
  std::map<std::uint32_t, std::vector<const tracing::Job*>> open;  // by node
  for (const tracing::Job& job : recorded.jobs) {
    const std::uint32_t c = job.ref.callback;
    if (!job.ended || c >= is_task.size() || !is_task[c]) continue;
    auto& others = open[recorded.system.callbacks[c].node];
    std::erase_if(others, [&](const tracing::Job* o) { return o->finish <= job.start; });
    for (const tracing::Job* other : others) {
      if (other->thread == job.thread) continue;
      result.others[c] = result.others[other->ref.callback] = true;
      if (other->ref.callback == c) result.itself[c] = true;
    }
    others.push_back(&job);
  }
  return result;
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
    const std::size_t requests = jobs_of[s].size();
    const std::string& name = system.topics[service.topic].name;
    Caller best;
    for (std::uint32_t c = 0; c < jobs_of.size(); ++c) {
      const tracing::Callback& of = system.callbacks[c];
      const bool responds =
          of.kind == CallbackKind::client && system.topics[of.topic].name == name + "/response";
      if (!client_nodes[service.topic].contains(of.node) || responds || c == s || jobs_of[c].empty())
        continue;
      const std::size_t n = std::max<std::size_t>(1, (jobs_of[c].size() + requests / 2) / requests);
      for (std::size_t first = 0; first < n; ++first) {
        Caller caller = matched(jobs, jobs_of[s], jobs_of[c], first, n);
        if (!caller.explains(requests)) continue;
        if (best.callback == kNone || caller.rank() < best.rank()) best = std::move(caller);
      }
    }
    if (best.callback == kNone) continue;
    for (const auto& [request, sender] : best.matches) {
      tracing::Job& sent = jobs[sender];
      // The service may have started before the end of the job.
      jobs[request].sample.published = std::min(sent.finish, jobs[request].start);
      sent.published.push_back(
          {service.topic, jobs[request].sample.published, std::min(sent.finished, jobs[request].started)});
      jobs[request].sample.parent = sent.ref;
    }
    notes.push_back(program::concat("A trace does not show who calls a service: node ",
                                    system.nodes[system.callbacks[best.callback].node],
                                    " is taken to send the requests to ", name, ", which follow ",
                                    best.matches.size(), " of ", best.jobs, " jobs of one of its callbacks",
                                    best.n > 1 ? program::concat(", one in ", best.n, ".") : "."));
  }
  return notes;
}

}  // namespace hotpath::imports
