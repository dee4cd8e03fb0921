// SPDX-License-Identifier: Apache-2.0
#include "import/import_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "import/recognition.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using nlohmann::json;

/// A gap without events of more periods of the slowest timer is reported.
constexpr int kGap = 10;

double seconds_of(Duration d) { return static_cast<double>(d.count()) / 1e9; }

std::string rule_text(const Recording& recording, const InferredRule& rule) {
  std::vector<std::string> names;
  for (const std::uint32_t c : rule.of)
    names.push_back(recording.system.topics[recording.system.callbacks[c].topic].name);
  const std::string topics = program::joined(names);
  switch (rule.rule) {
    case PublishRule::always:
      return "with every job";
    case PublishRule::every:
      return program::concat("with one in ", rule.n, " jobs");
    case PublishRule::all_new:
      return "when all are new: " + topics;
    case PublishRule::last_of:
      return "with every job, with the last of " + topics + " (assumed)";
  }
  return {};
}

std::vector<std::string> publishers_of(const RecordedGraph& graph, const InferredRule& rule) {
  std::vector<std::string> names;
  for (const std::uint32_t c : rule.publishers) names.push_back(graph.tasks.set[graph.task_of[c]].name);
  return names;
}

json rules_json(const Recording& recording) {
  json rules = json::array();
  for (const InferredRule& rule : recording.graph.rules) {
    rules.push_back({{"topic", recording.system.topics[rule.topic].name},
                     {"publishers", publishers_of(recording.graph, rule)},
                     {"rule", rule_text(recording, rule)},
                     {"jobs", rule.jobs},
                     {"explained", rule.explained},
                     {"as_good", rule.as_good},
                     {"most_in_a_job", rule.most_in_a_job}});
  }
  return rules;
}

json cost_json(const MeasuredCost& cost) {
  return {{"n", cost.n}, {"median_us", to_us(cost.median)}, {"p90_us", to_us(cost.p90)}};
}

json executors_json(const Facts& facts) {
  json executors = json::array();
  const Recording& recording = facts.recording;
  for (std::size_t e = 0; e < recording.executors.executors.size(); ++e) {
    const RecordedExecutor& executor = recording.executors.executors[e];
    const RecordedCosts& costs = facts.interpretations.best.costs[e];
    json threads = json::array();
    for (const std::uint32_t t : executor.threads) {
      const tracing::Thread& thread = recording.system.threads[t];
      threads.push_back(
          {{"thread", thread.id}, {"jobs", thread.jobs}, {"processors", usual_processors(thread)}});
    }
    executors.push_back({{"name", executor.name},
                         {"process", executor.process},
                         {"executor", facts.interpretations.best.labels[e]},
                         {"given", !recording.given.empty()},
                         {"recognition", recognition_json(recording.recognitions[e], recording.first_graph)},
                         {"threads", threads},
                         {"dispatch", cost_json(costs.dispatch)},
                         {"timer_dispatch", cost_json(costs.timer_dispatch)},
                         {"subscription_dispatch", cost_json(costs.subscription_dispatch)},
                         {"timer_wake_up", cost_json(costs.timer_wake_up)},
                         {"wait", cost_json(costs.wait)},
                         {"wake_up", cost_json(costs.wake_up)},
                         {"delivery", cost_json(costs.delivery)}});
  }
  return executors;
}

/// The data of the trace about each task.
json tasks_json(const Facts& facts) {
  const RecordedGraph& graph = facts.recording.graph;
  const tracing::System& system = facts.recording.system;
  std::vector<std::vector<double>> durations(graph.tasks.set.size());
  for (const tracing::Job& job : facts.recording.jobs) {
    const TaskId task = graph.task(job.ref);
    if (task != kNoTask && job.ended) durations[task].push_back(to_us(job.finish - job.start));
  }
  json tasks = json::array();
  for (TaskId id = 0; id < graph.tasks.set.size(); ++id) {
    if (graph.callback_of[id] == kNone) continue;
    const tracing::Callback& callback = system.callbacks[graph.callback_of[id]];
    std::ranges::sort(durations[id]);
    json& task = tasks.emplace_back(json{{"task", graph.tasks.set[id].name},
                                         {"kind", to_string(graph.tasks.set[id].kind)},
                                         {"node", system.nodes[callback.node]},
                                         {"jobs", callback.jobs},
                                         {"never_ended", callback.never_ended},
                                         {"threads", callback.threads.size()},
                                         {"published", json::object()}});
    if (!durations[id].empty()) {
      // Observed durations without interpolation: other readers of the trace find the same.
      const auto ranked = [&](std::size_t percent) {
        return durations[id][std::min(durations[id].size() - 1, durations[id].size() * percent / 100)];
      };
      task["duration_us"] = {
          {"p50", ranked(50)}, {"p90", ranked(90)}, {"p99", ranked(99)}, {"max", ranked(100)}};
    }
    for (const auto& [topic, messages] : callback.published)
      task["published"][system.topics[topic].name] = messages;
    if (graph.tasks.set[id].kind == TaskKind::timer) {
      task["period_ms"] = to_ms(callback.period);
      task["created_ns"] = to_ns(callback.created);
    } else {
      task["topic"] = system.topics[callback.topic].name;
      task["samples"] = callback.samples;
      task["strangers"] = callback.strangers;
    }
  }
  return tasks;
}

/// How often and how long callbacks ran that are not in the graph.
json housekeeping_json(const Facts& facts) {
  std::uint64_t callbacks = 0, jobs = 0;
  Duration busy{};
  for (std::uint32_t c = 0; c < facts.recording.system.callbacks.size(); ++c) {
    const tracing::Callback& callback = facts.recording.system.callbacks[c];
    if (facts.recording.graph.task({c, 0}) != kNoTask) continue;
    ++callbacks;
    jobs += callback.jobs;
    busy += callback.busy;
  }
  return {{"callbacks", callbacks}, {"jobs", jobs}, {"busy_ms", to_ms(busy)}};
}

std::vector<std::string> warnings(const Facts& facts) {
  std::vector<std::string> all;
  const tracing::TraceReading& r = facts.reading;
  const auto warn = [&](const auto&... parts) { all.push_back(program::concat(parts...)); };
  if (!r.broken_off.empty()) warn("The trace breaks off: ", r.broken_off, ". The events before are used.");
  if (r.discarded_events + r.discarded_packets > 0)
    warn("The tracer discarded at least ", r.discarded_events, " events and ", r.discarded_packets,
         " packets; the numbers of jobs, messages and losses are unreliable. Record with larger buffers "
         "(`--subbuf-size`, `--num-subbuf`).");
  const tracing::System& system = facts.recording.system;
  Duration longest_period = std::chrono::milliseconds(100);
  for (const tracing::Callback& c : system.callbacks) longest_period = std::max(longest_period, c.period);
  if (r.longest_gap > kGap * longest_period) {
    all.push_back(program::text(
        "The trace has no event for %.1f s from %.1f s on: its clock jumped, or the system stood still. Jobs "
        "that were due meanwhile count as lost, and the self-check is not reliable.",
        seconds_of(r.longest_gap), seconds_of(r.gap_begin - r.first)));
  }
  if (system.reused_handles > 0)
    warn(system.reused_handles,
         " addresses of callbacks were reused after the end of their callback; time tells their jobs apart.");
  if (system.ends_without_start > 0) warn(system.ends_without_start, " ends of callbacks have no start.");
  std::uint64_t never_ended = 0;
  for (const tracing::Callback& c : system.callbacks) never_ended += c.never_ended;
  if (never_ended > 0) warn(never_ended, " jobs have no end in the trace; they count as running.");
  all.insert(all.end(), facts.recording.graph.notes.begin(), facts.recording.graph.notes.end());
  return all;
}

}  // namespace

GraphComments import_comments(const Recording& recording, const Interpretation& best) {
  GraphComments comments;
  comments.header = program::concat(
      "Imported from a trace of ros2_tracing; see import.md.\n"
      "Recorded executor: ",
      best.executor->label, ".");
  for (const InferredRule& rule : recording.graph.rules) {
    for (const std::string& publisher : publishers_of(recording.graph, rule)) {
      std::string& text = comments.of[publisher];
      if (!text.empty()) text += "; ";
      text += program::concat(recording.system.topics[rule.topic].name, " ", rule_text(recording, rule),
                              ": explains ", rule.explained, " of ", rule.jobs, " jobs");
    }
  }
  return comments;
}

json import_json(const Facts& facts) {
  const Interpretation& best = facts.interpretations.best;
  json tried = json::array();
  for (const auto& [label, similarity] : facts.interpretations.tried)
    tried.push_back({{"executor", label}, {"similarity", similarity}});
  return {{"trace", facts.trace},
          {"version", HOTPATH_VERSION},
          {"events", facts.reading.events},
          {"all_events", facts.reading.all_events},
          {"duration_s", seconds_of(facts.reading.length())},
          {"jobs", facts.recording.jobs.size() + facts.later_jobs},
          {"window_jobs", facts.recording.jobs.size()},
          {"warnings", warnings(facts)},
          {"processes", facts.recording.system.processes.size()},
          {"rcl_version", facts.recording.system.rcl_version},
          {"executors", executors_json(facts)},
          {"tried", tried},
          {"execution_times", to_string(best.graph.platform.execution_times)},
          {"deliveries", deliveries_json(facts.recording.system, facts.recording.deliveries)},
          {"tasks", tasks_json(facts)},
          {"rules", rules_json(facts.recording)},
          {"left_out", housekeeping_json(facts)},
          {"self_check", best.check}};
}

void print_import(std::ostream& out, const Facts& facts, const std::filesystem::path& output) {
  const Interpretation& best = facts.interpretations.best;
  out << program::text("%llu events in %.1f s: %zu nodes, %u tasks, %zu jobs; executor %s\n",
                       static_cast<unsigned long long>(facts.reading.all_events),
                       seconds_of(facts.reading.length()), best.graph.nodes.size(), best.tasks.set.size(),
                       facts.recording.jobs.size() + facts.later_jobs, best.executor->label.c_str());
  for (const std::string& warning : warnings(facts)) out << "warning: " << warning << '\n';
  const SelfCheck& check = best.check;
  for (std::size_t e = 0; e < best.labels.size(); ++e) {
    const Recognition& recognition = facts.recording.recognitions[e];
    out << "Recognition of " << facts.recording.executors.executors[e].name << ": "
        << to_string(recognition.verdict) << ". " << sentence(recognition, facts.recording.first_graph)
        << '\n';
  }
  out << program::text("Reproduction: %s (order of jobs %.3f similar)\n", to_string(check.light),
                       check.schedule.similarity);
  for (const auto& chain : check.chains) {
    if (!std::isfinite(chain.recorded_ms.p50) || !std::isfinite(chain.simulated_ms.p50)) continue;
    out << program::text(
        "  %s: median %.2f ms recorded, %.2f simulated (%+.1f %%); p99 %.2f, %.2f (%+.1f %%)\n",
        chain.chain.c_str(), chain.recorded_ms.p50, chain.simulated_ms.p50, chain.median_error_percent,
        chain.recorded_ms.p99, chain.simulated_ms.p99, chain.p99_error_percent);
  }
  out << program::text("  lost: %.2f %% recorded, %.2f %% simulated\n", check.lost_recorded_percent,
                       check.lost_simulated_percent);
  for (const std::string& reason : check.reasons) out << "  " << reason << '\n';
  out << "\nResults: " << output.string() << " (graph.yaml, run/, simulated/, import.md)\n";
}

}  // namespace hotpath::imports
