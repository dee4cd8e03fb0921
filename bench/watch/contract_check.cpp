// SPDX-License-Identifier: Apache-2.0
#include "watch/contract_check.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

using tracing::CallbackKind;
using tracing::kNone;

ContractCheck::ContractCheck(Contract contract, Duration realtime)
    : contract_(std::move(contract)),
      states_(contract_.callbacks.size()),
      names_(contract_),
      chain_check_(contract_, names_),
      thread_check_(contract_),
      publisher_check_(contract_, names_) {
  set_realtime(realtime);
  for (const CallbackContract& callback : contract_.callbacks)
    subjects_.emplace_back("callback", callback.name(), callback.terms, "no such callback has run");
  for (const ChainContract& chain : contract_.chains)
    subjects_.emplace_back("chain", chain.name, chain.terms, "no data of its sources reached its end");
}

std::uint32_t ContractCheck::entry_of(const tracing::System& system, std::uint32_t callback) {
  if (callback >= entries_.size()) entries_.resize(callback + 1);
  if (!names_.resolve(system)) return kNone;
  if (std::exchange(changes_, names_.changes()) != names_.changes())
    std::ranges::fill(entries_, std::nullopt);
  if (!entries_[callback]) entries_[callback] = find_entry(system, callback);
  if (*entries_[callback] != kNone) names_.keep();
  return *entries_[callback];
}

std::uint32_t ContractCheck::find_entry(const tracing::System& system, std::uint32_t callback) const {
  const tracing::Callback& of = system.callbacks[callback];
  const bool timer = of.kind == CallbackKind::timer, service = of.kind == CallbackKind::service,
             subscription = of.kind == CallbackKind::subscription;
  if (of.node >= system.nodes.size() || (!timer && !service && !subscription)) return kNone;
  if (!timer && of.topic >= system.topics.size()) return kNone;
  const std::string node = names_.node(system, of.node);
  const std::string topic = timer ? "" : names_.topic(system, of.topic);
  std::uint32_t number = 0;
  for (std::uint32_t c = 0; c <= callback; ++c)
    number += system.callbacks[c].kind == CallbackKind::timer && system.callbacks[c].node == of.node ? 1 : 0;
  const auto entry_for = [&](bool a_service) {
    return std::ranges::find_if(contract_.callbacks, [&](const CallbackContract& stated) {
      return stated.node == node && stated.topic == topic && stated.service == a_service &&
             (!timer || stated.timer == number);
    });
  };
  const auto is_service = [&](const tracing::Callback& c) {
    return c.kind == CallbackKind::service && c.node == of.node && c.topic < system.topics.size() &&
           system.topics[c.topic].name == system.topics[of.topic].name;
  };
  auto entry = entry_for(service);
  // Without ROS 2, subscriptions stand for the services of a graph.
  if (entry == contract_.callbacks.end() && subscription &&
      std::ranges::none_of(system.callbacks, is_service))
    entry = entry_for(true);
  if (entry == contract_.callbacks.end() && timer) return replaced_timer(node, number, of);
  return entry == contract_.callbacks.end() ? kNone
                                            : static_cast<std::uint32_t>(entry - contract_.callbacks.begin());
}

std::uint32_t ContractCheck::replaced_timer(const std::string& node, std::uint32_t number,
                                            const tracing::Callback& by) const {
  std::uint32_t replaced = kNone;
  for (std::uint32_t c = 0; c < contract_.callbacks.size(); ++c) {
    const CallbackContract& stated = contract_.callbacks[c];
    if (stated.node != node || !stated.topic.empty()) continue;
    if (stated.timer >= number) return kNone;  // the contract states timers beyond this one
    const auto period = std::ranges::find(stated.terms, Clause::period, &Term::clause);
    const std::optional<Time>& last = states_[c].last;
    if (period == stated.terms.end() || period->limit != by.period.count()) continue;
    if (last && *last < by.created && (replaced == kNone || *last < *states_[replaced].last)) replaced = c;
  }
  return replaced;
}

void ContractCheck::started(const tracing::System& system, const tracing::Job& job,
                            std::optional<Time> timestamp) {
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  thread_check_.started(system, job, entry, incidents_);
  if (entry == kNone) return;
  processes_.try_emplace(system.threads[job.thread].process, Process{entry, job.start});
  const bool traced = job.has_sample && job.sample.parent.callback != kNone;
  chain_check_.started(entry, job, traced ? entry_of(system, job.sample.parent.callback) : kNone, timestamp);
  Subject& subject = subjects_[entry];
  subject.seen = true;
  const tracing::Callback& callback = system.callbacks[job.ref.callback];
  if (callback.kind == CallbackKind::service) return;  // no event tells of requests
  if (callback.depth > 0)                              // 0: keeps all, or unknown
    subject.compare(Clause::depth, callback.depth, job.start, incidents_);
  if (callback.kind == CallbackKind::timer) {
    subject.compare(Clause::period, callback.period.count(), job.start, incidents_);
    states_[entry].callback = job.ref.callback;
    arrived(entry, job.start);
  } else if (job.has_sample) {
    arrived(system, entry, job.ref.callback, job.sample);
  }
}

/// A timer's job started, or a sample was published.
void ContractCheck::arrived(std::uint32_t entry, Time at) {
  CallbackState& state = states_[entry];
  if (state.last && at < *state.last) return;  // published before samples that were taken earlier
  const bool ends_silence = state.silent && at > state.silent_since;
  JudgedTerm* const distance = subjects_[entry].find(Clause::maximum_distance);
  if (distance && state.last && lossless_) {
    if (ends_silence) {  // it may have been published before the silence was judged
      const Duration length = std::max(at, *state.silent) - state.silent_since;
      distance->judge_ended(state.silent_since, length, incidents_);
    } else {
      distance->compare((at - *state.last).count(), at, incidents_);
    }
  }
  state.last = at;
  if (ends_silence) state.silent.reset();
}

/// A sample was taken or overwritten.
void ContractCheck::arrived(const tracing::System& system, std::uint32_t entry, std::uint32_t callback,
                            const tracing::Sample& sample) {
  CallbackState& state = states_[entry];
  const std::uint32_t topic = names_.number_of(system, system.callbacks[callback].topic);
  const bool watched = sample.parent.callback != kNone;
  if (std::exchange(state.callback, callback) != callback) {  // its node was started again
    state.samples.clear();
    state.watched = false;
  }
  if (!watched && state.watched && topic != kNone && lossless_)
    publisher_check_.from_stranger(topic, sample.published, incidents_);
  state.watched = state.watched || watched;
  arrived(entry, sample.published);
  JudgedTerm* const distance = subjects_[entry].find(Clause::minimum_distance);
  if (distance == nullptr) return;
  if (!state.samples.empty() && (state.samples.back().sequence + 1 != sample.sequence || !lossless_))
    state.samples.clear();  // another subscription, or unknown ones between them
  std::vector<Duration> distances;
  for (auto before = state.samples.rbegin(); before != state.samples.rend(); ++before)
    distances.push_back(sample.published - before->published);
  distance->compare_distances(distances, sample.published, incidents_);
  state.samples.push_back(sample);
  if (state.samples.size() > distance->term().further.size() + 1) state.samples.pop_front();
}

void ContractCheck::published(const tracing::System& system, const tracing::Job& job,
                              const tracing::Publication& p) {
  const std::uint32_t topic = names_.number_of(system, p.topic);
  if (topic == kNone) return;
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  publisher_check_.published(system, job, topic, entry, entry == kNone ? nullptr : &subjects_[entry],
                             incidents_);
  if (entry != kNone) chain_check_.published(job, topic);
}

void ContractCheck::remember(const tracing::System& system, const tracing::Job& job) {
  constexpr Duration kLength = std::chrono::seconds(5);
  constexpr std::size_t kMost = 10'000;
  past_jobs_.push_back({job.ref.callback, job.start, job.finish});
  while (past_jobs_.size() > kMost || past_jobs_.front().finish + kLength < job.finish)
    past_jobs_.pop_front();
  const auto process = processes_.find(system.threads[job.thread].process);
  if (process != processes_.end()) process->second.finish = std::max(process->second.finish, job.finish);
}

void ContractCheck::ended(const tracing::System& system, const tracing::Job& job, const RunningJob& ran) {
  if (job.ended) remember(system, job);
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  if (entry == kNone) return;
  Subject& subject = subjects_[entry];
  const std::vector<ChainOutput>& outputs = chain_check_.ended(job);
  if (!job.ended || is_doubtful(job.start)) return;
  if (JudgedTerm* const budget = subject.find(Clause::budget)) {
    const Duration length = job.finish - job.start - ran.displaced;
    if (ran.overdue) {
      budget->judge_ended(*ran.overdue, std::max(length, ran.judged), incidents_);
    } else {
      budget->compare(length.count(), job.finish, incidents_);
    }
  }
  if (JudgedTerm* const publishes = subject.find(Clause::publishes); publishes && job.published.empty())
    publishes->hold();
  if (ran.timestamp && (lossless_ || job.has_sample))  // a timer's is derived from its earlier jobs
    subject.compare(Clause::response, (job.finish - *ran.timestamp).count(), job.finish, incidents_);
  if (!lossless_) return;
  if (system.callbacks[job.ref.callback].kind != CallbackKind::service && states_[entry].lost == 0)
    subject.compare(Clause::lost, 0, job.finish, incidents_);
  for (const ChainOutput& output : outputs) judge(output);
}

void ContractCheck::judge(const ChainOutput& output) {
  Subject& chain = subjects_[contract_.callbacks.size() + output.chain];
  chain.seen = true;
  chain.compare(Clause::hot_path, output.hot_path.count(), output.start, incidents_);
  if (!output.age) return;
  chain.compare(Clause::age, output.age->count(), output.finish, incidents_);
  chain.compare(Clause::requirement, output.age->count(), output.finish, incidents_);
}

void ContractCheck::lost(const tracing::System& system, const tracing::LostSample& sample) {
  const std::uint32_t entry = entry_of(system, sample.subscription);
  if (entry == kNone || !lossless_) return;                   // its take may be among the lost events
  if (sample.subscription < states_[entry].callback) return;  // no event tells that this one has ended
  arrived(system, entry, sample.subscription, sample.sample);
  subjects_[entry].compare(Clause::lost, static_cast<std::int64_t>(++states_[entry].lost),
                           sample.sample.published, incidents_);
}

void ContractCheck::note_losses(std::uint64_t losses, Time until) {
  if (losses == losses_) return;
  losses_ = losses;
  lost_at_ = until;
  lossless_ = false;
}

void ContractCheck::observed_until(const tracing::System& system, RunningJobs& running, Time until,
                                   std::uint64_t losses) {
  constexpr auto kPause = std::chrono::milliseconds(100);
  constexpr auto kDoubt = std::chrono::seconds(5);
  note_losses(losses, until);
  lossless_ = !ending_ && (!lost_at_ || until > *lost_at_ + kDoubt);
  if (observed_until_ && until < *observed_until_ + kPause) return;
  observed_until_ = until;
  begin_ = begin_.value_or(until);
  judge_processes(until);
  if (lossless_) judge_never_run(system, until);
  publisher_check_.created(system, names_, until, incidents_);
  judge_running(system, running, until);
  for (std::uint32_t entry = 0; lossless_ && entry < states_.size(); ++entry)
    judge_silence(system, entry, until);
}

void ContractCheck::judge_running(const tracing::System& system, RunningJobs& running, Time until) {
  for (RunningJob& job : running.all()) {
    const std::uint32_t entry = entry_of(system, job.ref.callback);
    JudgedTerm* const budget = entry == kNone ? nullptr : subjects_[entry].find(Clause::budget);
    if (budget == nullptr || job.overdue || is_doubtful(job.start)) continue;
    const std::optional<Time> start = running.undisplaced_start(job);
    if (!start || (until - *start).count() <= budget->term().limit) continue;
    job.overdue = start;
    job.judged = until - *start;
    budget->judge_lasting(*start, until, incidents_);
  }
}

void ContractCheck::judge_silence(const tracing::System& system, std::uint32_t entry, Time until) {
  CallbackState& state = states_[entry];
  JudgedTerm* const distance = subjects_[entry].find(Clause::maximum_distance);
  if (distance == nullptr || !state.last || state.silent) return;
  // Samples wait unread while another callback runs, and those of unwatched publishers are known only when
  // they are taken: only what nothing can explain is silence.
  const Time since = std::max(*state.last, system.callbacks[state.callback].published_for_it);
  if ((until - since).count() <= 2 * distance->term().limit) return;
  state.silent = until;
  state.silent_since = since;
  distance->judge_lasting(since, until, incidents_);
}

void ContractCheck::forget(const ThreadKey& ended) {
  thread_check_.forget(ended);
  const auto process = processes_.find(ended.first);
  if (ended.second != 0 || process == processes_.end()) return;
  process->second.noticed = observed_until_.value_or(process->second.finish);
  if (!ending_) gone_.push_back(process->second);
  processes_.erase(process);
}

/// At the end of a run, its processes end one after another.
void ContractCheck::judge_processes(Time until) {
  constexpr auto kEnding = std::chrono::seconds(2);
  std::erase_if(gone_, [&](const Process& process) {
    if (until < process.noticed + kEnding) return false;
    incidents_.add(
        {Role::standstill, process.finish, "the process of " + subjects_[process.entry].name + " has ended"});
    return true;
  });
}

/// A program may create its nodes long before it runs them.
void ContractCheck::judge_never_run(const tracing::System& system, Time until) {
  constexpr Duration kSearch = std::chrono::seconds(1), kPatience = std::chrono::seconds(10);
  if (!names_.kept() || (searched_ && until < *searched_ + kSearch)) return;
  searched_ = until;
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    const tracing::Callback& callback = system.callbacks[c];
    const bool timer = callback.kind == CallbackKind::timer;
    if (callback.jobs > 0 || (timer ? callback.created + kPatience > until : callback.samples == 0)) continue;
    const std::uint32_t entry = entry_of(system, c);
    if (entry == kNone || subjects_[entry].seen || states_[entry].never_ran) continue;
    std::optional<Time>& since = states_[entry].waited_for;
    if (!since) since = timer ? std::max(callback.created, *begin_) : callback.published_for_it;
    const JudgedTerm* const distance = subjects_[entry].find(Clause::maximum_distance);
    if (timer && distance == nullptr) continue;
    const Time latest = timer ? until - 2 * Duration(distance->term().limit) : callback.published_for_it;
    if (latest < *since + kPatience) continue;
    states_[entry].never_ran = true;
    incidents_.add(
        {Role::standstill, *since,
         subjects_[entry].name + (timer ? " has never run" : " has never run, although it got samples"),
         nullptr, *since, until});
  }
}

std::vector<Fact> ContractCheck::jobs(const tracing::System& system, Time since, Time until,
                                      const std::string& except) {
  constexpr std::size_t kMostShown = 5;
  std::vector<PastJob> meanwhile;
  for (const PastJob& job : past_jobs_)
    if (job.finish > since && job.start < until) meanwhile.push_back(job);
  std::ranges::stable_sort(meanwhile, std::greater(), [](const PastJob& j) { return j.finish - j.start; });
  std::vector<Fact> facts;
  for (const PastJob& job : meanwhile) {
    const std::uint32_t entry = entry_of(system, job.callback);
    const std::string name =
        entry == kNone ? callback_name(system, system.callbacks[job.callback]) : subjects_[entry].name;
    if (name == except || facts.size() == kMostShown) continue;
    facts.push_back({Role::circumstance, job.finish,
                     name + " ran " + program::fixed(to_ms(job.finish - job.start), 3) + " ms"});
  }
  return facts;
}

void ContractCheck::describe(const tracing::System& system, bool at_end) {
  for (Incident& incident : incidents_.kept()) {
    const Fact& first = incident.first();
    const bool read = contract_.threads.empty() || thread_check_.at() >= first.at;
    if (incident.is_described() || (!read && !at_end)) continue;
    const bool tells_job = first.term != nullptr && first.term->clause() == Clause::budget;
    std::vector<Fact> meanwhile =
        jobs(system, first.since, first.until, tells_job ? first.term->subject() : "");
    const std::vector<Fact> waits = thread_check_.waits(first.since, first.until);
    meanwhile.insert(meanwhile.end(), waits.begin(), waits.end());
    incident.describe(meanwhile);
  }
}

ContractCheck::Verdict ContractCheck::verdict(const Subject& subject, const JudgedTerm& term,
                                              const Losses& losses) const {
  constexpr const char* kUnseen = "not observable";
  if (const std::optional<Fact>& first = term.first())
    return {subject, term, "broken",
            program::concat(term.broken(), " of ", term.checked(), "; first at ",
                            time_of_day(first->at, incidents_.realtime()), ": ", first->sentence)};
  if (!subject.seen) return {subject, term, kUnseen, subject.unseen};
  if (term.checked() == 0) return {subject, term, kUnseen, "no event tells it"};
  if (losses.total() > 0) return {subject, term, kUnseen, "events were lost"};
  return {subject, term, "held", program::concat(term.checked(), " of ", term.checked())};
}

std::vector<ContractCheck::Verdict> ContractCheck::verdicts(const Losses& losses) const {
  std::vector<Verdict> all;
  for (const auto* subjects : {&subjects_, &thread_check_.subjects(), &publisher_check_.subjects()})
    for (const Subject& subject : *subjects)
      for (const JudgedTerm& term : subject.terms) all.push_back(verdict(subject, term, losses));
  return all;
}

program::TextTable ContractCheck::table(const Losses& losses) const {
  program::TextTable table("Contract", {"of", "term", "limit", "observed", "verdict", "reason"});
  for (const auto& [subject, term, word, reason] : verdicts(losses))
    table.add_row({subject.kind == "callback" ? subject.name : subject.kind + " " + subject.name,
                   term.title(), term.limit_text(), term.extreme_text(), word, reason});
  return table;
}

nlohmann::json ContractCheck::json(const Losses& losses) const {
  nlohmann::json terms = nlohmann::json::array();
  for (const auto& [subject, term, word, reason] : verdicts(losses)) {
    nlohmann::json& stored = terms.emplace_back(term.json());
    stored[subject.kind] = subject.name;
    stored["verdict"] = word;
    stored["reason"] = reason;
  }
  nlohmann::json incidents = nlohmann::json::array();
  for (const Incident& incident : incidents_.kept()) incidents.push_back(incident.json());
  return {{"terms", terms}, {"incident", incident()}, {"incidents", incidents}};
}

}  // namespace hotpath::watch
