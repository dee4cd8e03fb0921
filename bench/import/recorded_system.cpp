// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_system.hpp"

#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "hotpath/core/time.hpp"
#include "hotpath/core/worker.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::CallbackKind, tracing::Duration, tracing::Time;

/// Share of requests that a caller must explain, and of its jobs that must have sent one.
constexpr double kExplained = 0.9;
/// A thread with a request to serve does not idle for longer.
constexpr Duration kServedWithin = std::chrono::milliseconds(1);
/// Requests in fewer of a callback's jobs than in one of two are believed from so many on.
constexpr std::size_t kFewestCalls = 4;

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

/// Release-and-execute: a thread with timers only serves the same nodes as the other thread, or
/// both are the only ones of their process.
bool has_timers_of(std::uint32_t timers, std::uint32_t others, const tracing::System& system,
                   const std::vector<ThreadUse>& uses) {
  const ThreadUse &a = uses[timers], &b = uses[others];
  const bool apart = a.timers && !a.others && b.others && !b.timers;
  if (!apart || system.threads[timers].waits + system.threads[others].waits > 0) return false;
  if (std::ranges::any_of(a.nodes, [&](std::uint32_t node) { return b.nodes.contains(node); })) return true;
  const std::uint32_t process = system.threads[timers].process;
  int of_process = 0;
  for (std::uint32_t t = 0; t < uses.size(); ++t)
    of_process += system.threads[t].process == process && !uses[t].nodes.empty();
  return process == system.threads[others].process && of_process == 2;
}

std::vector<RecordedExecutor> recorded_executors(const tracing::System& system) {
  std::vector<ThreadUse> uses(system.threads.size());
  std::vector<std::uint32_t> number_of(uses.size());  // by thread: threads of one executor have one number
  std::iota(number_of.begin(), number_of.end(), 0U);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    std::ranges::replace(number_of, std::uint32_t{number_of[b]}, std::uint32_t{number_of[a]});
  };
  for (const tracing::Callback& callback : system.callbacks) {
    if (!defines_executor(callback)) continue;
    for (const auto& [thread, jobs] : callback.threads) {
      (callback.kind == CallbackKind::timer ? uses[thread].timers : uses[thread].others) = true;
      uses[thread].nodes.insert(callback.node);
      join(callback.threads.begin()->first, thread);
    }
  }
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
      const std::string process =
          system.processes.size() > 1 ? program::concat("process_", first.process, "_") : "";
      executors.push_back({program::concat(process, "thread_", first.id), first.process, {}});
    }
    executors[at->second].threads.push_back(t);
  }
  return executors;
}

/// A callback that may have sent the requests, in each n-th job.
struct Caller {
  std::uint32_t callback = kNone;
  std::size_t n = 1, jobs = 0;
  std::vector<RequestMatch> matches = {};
  Duration delays{};          ///< Sum of the distances of its jobs' ends to the starts of the service's.
  std::ptrdiff_t idled = 0;   ///< Requests before which the service's thread idled.
  std::ptrdiff_t passed = 0;  ///< These, and those that it did not serve in its next round.

  [[nodiscard]] bool explains(std::size_t requests) const {
    return static_cast<double>(matches.size()) >=
               kExplained * static_cast<double>(std::max(requests, jobs)) &&
           (n == 1 || (2 * idled <= std::ssize(matches) && requests >= kFewestCalls));
  }
  /// In steps of a tenth: a late delivery idles, too.
  [[nodiscard]] std::ptrdiff_t late() const { return 10 * passed / std::ssize(matches); }
  [[nodiscard]] auto rank() const { return std::tuple(late(), n, delays); }
};

/// How long the thread of a request idled between the end of the job and the request.
Duration idle_time(const std::vector<tracing::Job>& jobs, const RequestMatch& match) {
  const auto& [request, sent] = match;
  const Time from = jobs[sent].finish, until = jobs[request].sample.published;
  Duration idle = until - from;
  for (std::size_t j = request; j-- > 0 && idle > Duration{};) {
    if (jobs[j].thread != jobs[request].thread || !jobs[j].ended) continue;
    idle -= std::max(Duration{}, std::min(jobs[j].finish, until) - std::max(jobs[j].start, from));
    if (jobs[j].start <= from) break;
  }
  return idle;
}

/// Whether the executor of a request ended two waits since the job: the first one would have found it.
bool missed_a_round(const std::vector<tracing::Job>& jobs, const RequestMatch& match) {
  const auto& [request, sent] = match;
  const Time from = jobs[sent].finish + kServedWithin;
  int waits = jobs[request].waited;
  for (std::size_t j = request; j-- > 0 && jobs[j].start > from && waits < 2;)
    waits += jobs[j].thread == jobs[request].thread && jobs[j].waited;
  return waits == 2;
}

/// Each job of the service takes the latest job of the candidate that began before it, unless an
/// earlier one has. `sent`: the candidate's jobs, of which those from `first` on in steps of n count.
Caller matched(const std::vector<tracing::Job>& jobs, const std::vector<std::size_t>& served,
               const std::vector<std::size_t>& sent, std::size_t first, std::size_t n) {
  Caller caller{jobs[sent.front()].ref.callback, n, (sent.size() - first + n - 1) / n};
  std::size_t next = first;
  for (const std::size_t request : served) {
    const std::size_t begin = next;
    while (next < sent.size() && jobs[sent[next]].start < jobs[request].sample.published) next += n;
    if (next == begin) continue;
    caller.matches.emplace_back(request, sent[next - n]);
    caller.delays += std::chrono::abs(jobs[request].start - jobs[sent[next - n]].finish);
  }
  for (const RequestMatch& match : caller.matches) {
    const bool idles = idle_time(jobs, match) > kServedWithin;
    caller.idled += idles;
    caller.passed += idles || missed_a_round(jobs, match);
  }
  return caller;
}

/// Makes the requests publications of these jobs.
void send(std::vector<tracing::Job>& jobs, std::uint32_t topic, const std::vector<RequestMatch>& matches) {
  for (const auto& [request, sender] : matches) {
    tracing::Job &sent = jobs[sender], &served = jobs[request];
    // The service may have started before the end of the job.
    served.sample.published = std::min(sent.finish, served.start);
    served.sample.parent = sent.ref;
    sent.published.push_back({topic, served.sample.published, std::min(sent.finished, served.started)});
  }
}

std::string text_of(const tracing::System& system, const Caller& caller) {
  const tracing::Callback& of = system.callbacks[caller.callback];
  return program::concat(system.nodes[of.node],
                         of.kind == CallbackKind::timer
                             ? program::concat(" (timer ", to_ms(of.period), " ms)")
                             : " " + system.topics[of.topic].name,
                         caller.n > 1 ? program::concat(", one in ", caller.n, " jobs") : "");
}

/// The best caller, and those that the recording does not tell from it, the best of each callback; `callers`:
/// at least one.
std::vector<Caller> likely_callers(std::vector<Caller> callers) {
  constexpr std::ptrdiff_t kContradicted = 5;  // tenths of the requests
  std::ranges::stable_sort(callers, {}, &Caller::rank);
  const std::ptrdiff_t late = callers.front().late();
  std::vector<Caller> all;
  for (Caller& caller : callers)
    if ((late >= kContradicted || caller.late() == late) &&
        std::ranges::count(all, caller.callback, &Caller::callback) == 0)
      all.push_back(std::move(caller));
  return all;
}

/// Attributes requests to the callbacks that sent them. Notes one sentence for each service with a caller.
void attribute_requests(RecordedSystem& recorded) {
  const tracing::System& system = recorded.system;
  std::vector<tracing::Job>& jobs = recorded.jobs;
  std::map<std::uint32_t, std::set<std::uint32_t>> client_nodes;  // by service
  for (const tracing::ServiceClient& client : system.clients)
    if (client.node != kNone) client_nodes[client.service].insert(client.node);
  std::vector<std::vector<std::size_t>> jobs_of(system.callbacks.size());
  for (std::size_t j = 0; j < jobs.size(); ++j)
    if (jobs[j].ended && jobs[j].ref.callback < jobs_of.size()) jobs_of[jobs[j].ref.callback].push_back(j);
  for (std::uint32_t s = 0; s < jobs_of.size(); ++s) {
    const tracing::Callback& service = system.callbacks[s];
    const std::size_t requests = jobs_of[s].size();
    if (service.kind != CallbackKind::service || requests == 0) continue;
    const std::string& name = system.topics[service.topic].name;
    std::vector<Caller> callers;
    for (std::uint32_t c = 0; c < jobs_of.size(); ++c) {
      const tracing::Callback& of = system.callbacks[c];
      const bool responds =
          of.kind == CallbackKind::client && system.topics[of.topic].name == name + "/response";
      if (!client_nodes[service.topic].contains(of.node) || responds || c == s || jobs_of[c].empty())
        continue;
      const std::size_t n = std::max<std::size_t>(1, (jobs_of[c].size() + requests / 2) / requests);
      for (std::size_t first = 0; first < n; ++first)
        if (Caller caller = matched(jobs, jobs_of[s], jobs_of[c], first, n); caller.explains(requests))
          callers.push_back(std::move(caller));
    }
    if (callers.empty()) continue;
    const std::vector<Caller> all = likely_callers(std::move(callers));
    const Caller& best = all.front();
    send(jobs, service.topic, best.matches);
    if (all.size() > 1) {
      OpenService& open = recorded.open.emplace_back(OpenService{service.topic});
      for (const Caller& caller : all) {
        open.callers.push_back(text_of(system, caller));
        open.matches.push_back(caller.matches);
      }
      continue;
    }
    recorded.remarks[Remark::assumed].push_back(program::concat(
        "A trace does not show who calls a service: node ",
        system.nodes[system.callbacks[best.callback].node], " is taken to send the requests to ", name,
        ", which follow ", best.matches.size(), " of ", best.jobs, " jobs of one of its callbacks",
        best.n > 1 ? program::concat(", one in ", best.n) : "", "."));
  }
}

std::vector<std::string> unseen_callbacks(const tracing::System& system,
                                          const std::vector<RecordedExecutor>& executors) {
  const auto is_unseen = [&](const RecordedExecutor& executor) {
    return std::ranges::count(system.clients, executor.process, &tracing::ServiceClient::process) > 0 &&
           std::ranges::none_of(executor.threads, [&](auto t) { return system.threads[t].waits > 0; }) &&
           std::ranges::none_of(system.stated_executors, [&](const tracing::StatedExecutor& stated) {
             return stated.states_ends && executor.is(stated);
           });
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

}  // namespace

RecordedSystem recorded_system(tracing::System system, std::vector<tracing::Job> jobs,
                               std::vector<tracing::LostSample> lost, unsigned cores) {
  std::ranges::sort(jobs, {}, &tracing::Job::started);
  RecordedSystem recorded{.jobs = std::move(jobs), .lost = std::move(lost), .system = std::move(system)};
  const std::vector<tracing::Callback>& callbacks = recorded.system.callbacks;
  const tracing::Job& last = recorded.jobs.back();
  recorded.end = (last.ended ? last.finish : last.start) + Duration(1);
  attribute_requests(recorded);
  recorded.executors = recorded_executors(recorded.system);
  recorded.remarks[Remark::missing] = unseen_callbacks(recorded.system, recorded.executors);
  recorded.executor_of.assign(callbacks.size(), kNone);
  for (std::uint32_t c = 0; c < callbacks.size(); ++c) {
    if (callbacks[c].node == kNone) continue;
    for (const auto& [thread, count] : callbacks[c].threads)
      for (std::uint32_t e = 0; e < recorded.executors.size() && recorded.executor_of[c] == kNone; ++e)
        if (recorded.executors[e].has(thread)) recorded.executor_of[c] = e;
  }
  std::set<std::int32_t> processors;
  for (const tracing::Thread& t : recorded.system.threads)
    for (const std::int32_t processor : usual_processors(t)) processors.insert(processor);
  const auto used = static_cast<unsigned>(std::clamp<std::size_t>(processors.size(), 1, kMaxWorkers));
  recorded.cores = cores > 0 ? cores : used;
  return recorded;
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

RecordedSystem RecordedSystem::with_caller(std::size_t open_service, std::size_t caller) const {
  RecordedSystem other = *this;
  const OpenService& service = open[open_service];
  for (const auto& [request, sender] : service.matches.front()) {
    std::erase_if(other.jobs[sender].published,
                  [&](const tracing::Publication& p) { return p.topic == service.topic; });
    other.jobs[request].sample.published = jobs[request].start;
    other.jobs[request].sample.parent = {};
  }
  send(other.jobs, service.topic, service.matches[caller]);
  return other;
}

std::vector<std::int32_t> usual_processors(const tracing::Thread& thread) {
  std::vector<std::int32_t> usual;
  for (const auto& [processor, jobs] : thread.processors)
    if (100 * jobs >= thread.jobs) usual.push_back(processor);
  return usual;
}

}  // namespace hotpath::imports
