// SPDX-License-Identifier: Apache-2.0
#include "import/stages.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using nlohmann::json, program::concat;

/// A gap without events of more periods of the slowest timer is reported.
constexpr int kGap = 10;
/// Most items of a line of the summary.
constexpr std::size_t kShown = 3;

std::vector<std::string> publishers_of(const RecordedGraph& graph, const InferredRule& rule) {
  std::vector<std::string> names;
  for (const std::uint32_t c : rule.publishers) names.push_back(graph.tasks.set[graph.task_of[c]].name);
  return names;
}

json rules_json(const Imported& imported) {
  const RecordedGraph& graph = imported.found.graph;
  json rules = json::array();
  for (const InferredRule& rule : graph.rules) {
    std::vector<std::string> as_good;
    for (const InferredRule& other : rule.as_good) as_good.push_back(rule_text(imported.system, other));
    rules.push_back({{"topic", imported.system.topics[rule.topic].name},
                     {"publishers", publishers_of(graph, rule)},
                     {"rule", rule_text(imported.system, rule)},
                     {"jobs", rule.jobs},
                     {"explained", rule.explained},
                     {"as_good", as_good},
                     {"most_in_a_job", rule.most_in_a_job}});
  }
  return rules;
}

json recognition_json(const Recognition& r) {
  json ranking = json::array();
  for (const Score& score : r.ranking) {
    ranking.push_back({{"executor", score.hypothesis.label},
                       {"agreement", score.agreement},
                       {"contradictions", score.contradictions},
                       {"margin", score.margin},
                       {"only_best_explains", score.against},
                       {"kinds_only_best_explains", score.kinds_against},
                       {"only_this_explains", score.in_favour},
                       {"only_best_explains_beyond_timing", score.plain_against},
                       {"unlikely", score.unlikely},
                       {"order_is_fitted", !score.evidence.empty()},
                       {"priorities_are_fitted", score.hypothesis.needs_levels() && r.stated.empty()}});
  }
  return {{"verdict", to_string(r.verdict)},
          {"executors", r.verdict == Verdict::none_fits ? std::vector<std::string>() : r.names()},
          {"sentence", sentence(r)},
          {"stated", r.stated},
          {"decisions", r.decisions},
          {"contested", r.contested},
          {"ranking", ranking}};
}

json executors_json(const Imported& imported) {
  json all = json::array();
  const Reproduction& best = imported.best;
  for (std::size_t e = 0; e < best.labels.size(); ++e) {
    const RecordedExecutor& executor = imported.recorded.executors[e];
    json threads = json::array();
    for (const std::uint32_t t : executor.threads) {
      const tracing::Thread& thread = imported.system.threads[t];
      threads.push_back(
          {{"thread", thread.id}, {"jobs", thread.jobs}, {"processors", usual_processors(thread)}});
    }
    all.push_back({{"name", executor.name},
                   {"process", executor.process},
                   {"executor", best.labels[e]},
                   {"given", imported.given[e]},
                   {"recognition", recognition_json(imported.recognitions[e])},
                   {"threads", threads}});
    for (const auto& [name, member] : kMeasuredCosts) {
      const MeasuredCost& cost = best.costs[e].*member;
      all.back()[name] = {{"n", cost.n}, {"median_us", to_us(cost.median)}, {"p90_us", to_us(cost.p90)}};
    }
  }
  return all;
}

/// The data of the trace about each task.
json tasks_json(const Imported& imported) {
  const RecordedGraph& graph = imported.found.graph;
  std::vector<std::vector<double>> durations_us(graph.tasks.set.size());
  for (const tracing::Job& job : imported.recorded.jobs) {
    const TaskId task = graph.task(job.ref);
    if (task != kNoTask && job.ended) durations_us[task].push_back(to_us(job.finish - job.start));
  }
  json tasks = json::array();
  for (TaskId id = 0; id < graph.tasks.set.size(); ++id) {
    if (graph.callback_of[id] == kNone) continue;
    const tracing::Callback& callback = imported.system.callbacks[graph.callback_of[id]];
    json& task = tasks.emplace_back(json{{"task", graph.tasks.set[id].name},
                                         {"kind", to_string(graph.tasks.set[id].kind)},
                                         {"node", imported.system.nodes[callback.node]},
                                         {"jobs", callback.jobs},
                                         {"never_ended", callback.never_ended},
                                         {"threads", callback.threads.size()},
                                         {"published", json::object()}});
    for (const auto& [name, percent] : {std::pair("p50", 50U), {"p90", 90U}, {"p99", 99U}, {"max", 100U}})
      if (!durations_us[id].empty()) task["duration_us"][name] = ranked(durations_us[id], percent);
    for (const auto& [topic, messages] : callback.published)
      task["published"][imported.system.topics[topic].name] = messages;
    if (graph.tasks.set[id].kind == TaskKind::timer) {
      task["period_ms"] = to_ms(callback.period);
      task["created_ns"] = to_ns(callback.created);
    } else {
      task["topic"] = imported.system.topics[callback.topic].name;
      task["samples"] = callback.samples;
      task["strangers"] = callback.strangers;
    }
  }
  return tasks;
}

json deliveries_json(const tracing::System& system, const RecordedDeliveries& deliveries) {
  json all = json::array();
  for (const auto& [topic, delivery] : deliveries) {
    json nodes = json::array();
    for (const std::uint32_t c : delivery.subscriptions) {
      const std::uint32_t node = system.callbacks[c].node;
      nodes.push_back(node == kNone ? "?" : system.nodes[node]);
    }
    all.push_back({{"topic", system.topics[topic].name},
                   {"subscribers", std::move(nodes)},
                   {"source", to_string(delivery.source)},
                   {"messages", delivery.messages},
                   {"agreeing", delivery.agreeing}});
  }
  return all;
}

json self_check_json(const SelfCheck& check) {
  const validation::ScheduleComparison& s = check.schedule;
  return {
      {"light", to_string(check.light)},
      {"reasons", check.reasons},
      {"similarity", s.similarity},
      {"first_difference", s.first_difference ? json{{"at_ms", s.first_difference->at_ms},
                                                     {"recorded", s.first_difference->measured},
                                                     {"simulated", s.first_difference->other}}
                                              : json()},
      {"response_p50_ms", {{"recorded", s.measured.response_ms.p50}, {"simulated", s.other.response_ms.p50}}},
      {"response_p99_ms", {{"recorded", s.measured.response_ms.p99}, {"simulated", s.other.response_ms.p99}}},
      {"chains", check.chains},
      {"lost_percent",
       {{"recorded", check.lost_recorded_percent}, {"simulated", check.lost_simulated_percent}}}};
}

/// How often and how long callbacks ran that are not in the graph; by name those with a share of the load.
json left_out_json(const Imported& imported) {
  constexpr double kLeast_percent = 0.05;
  std::uint64_t callbacks = 0, jobs = 0;
  Duration busy{};
  std::map<std::string, Duration> by_name;
  const std::vector<tracing::Callback>& all = imported.system.callbacks;
  for (std::uint32_t c = 0; c < all.size(); ++c) {
    if (imported.found.graph.task({c, 0}) != kNoTask) continue;
    ++callbacks;
    jobs += all[c].jobs;
    busy += all[c].busy;
    const bool known = all[c].node != kNone && all[c].topic != kNone;
    by_name[known ? concat(imported.system.topics[all[c].topic].name, " of ",
                           imported.system.nodes[all[c].node])
                  : "callbacks without a node or topic"] += all[c].busy;
  }
  std::vector<std::pair<double, std::string>> shares;
  for (const auto& [name, its] : by_name)
    if (const double share = 100 * to_s(its) / to_s(imported.reading.length()); share >= kLeast_percent)
      shares.emplace_back(share, program::text("%s (%.1f %% of a processor)", name.c_str(), share));
  std::ranges::sort(shares, std::greater());
  json named = json::array();
  for (const auto& [share, text] : shares) named.push_back(text);
  return {{"callbacks", callbacks}, {"jobs", jobs}, {"busy_ms", to_ms(busy)}, {"named", named}};
}

/// The first items, for one line.
std::string first_of(std::vector<std::string> items, const char* separator = "; ") {
  if (items.empty()) return "nothing";
  const std::size_t more = items.size() - std::min(items.size(), kShown);
  items.resize(items.size() - more);
  for (std::string& item : items)
    if (item.ends_with('.')) item.pop_back();
  if (more > 0) items.push_back(concat(more, " more in import.md"));
  return program::joined(items, separator);
}

/// What is wrong with the recording.
std::vector<std::string> defects(const Imported& imported) {
  std::vector<std::string> all;
  const tracing::TraceReading& r = imported.reading;
  const auto warn = [&](const auto&... parts) { all.push_back(concat(parts...)); };
  if (!r.broken_off.empty()) warn("The trace breaks off: ", r.broken_off, ". The events before are used.");
  if (r.discarded_events + r.discarded_packets > 0)
    warn("The tracer discarded at least ", r.discarded_events, " events and ", r.discarded_packets,
         " packets; the numbers of jobs, messages and losses are unreliable. Record with larger buffers "
         "(`--subbuf-size`, `--num-subbuf`).");
  const tracing::System& system = imported.system;
  Duration longest_period = std::chrono::milliseconds(100);
  std::uint64_t never_ended = 0;
  for (const tracing::Callback& c : system.callbacks) {
    longest_period = std::max(longest_period, c.period);
    never_ended += c.never_ended;
  }
  if (r.longest_gap > kGap * longest_period)
    warn(
        "The trace has no event for ", program::fixed(to_s(r.longest_gap), 1), " s from ",
        program::fixed(to_s(r.gap_begin - r.first), 1),
        " s on: its clock jumped, or the system stood still. Jobs that were due meanwhile count as lost, and "
        "the self-check is not reliable.");
  if (system.reused_handles > 0)
    warn(system.reused_handles,
         " addresses of callbacks were reused after the end of their callback; time tells their jobs apart.");
  if (system.ends_without_start > 0) warn(system.ends_without_start, " ends of callbacks have no start.");
  if (never_ended > 0) warn(never_ended, " jobs have no end in the trace; they count as running.");
  return all;
}

/// With the remarks that stand nowhere else in import.json.
std::vector<std::string> warnings(const Imported& imported) {
  std::vector<std::string> all = defects(imported);
  for (const auto& [kind, texts] : imported.remarks) {
    if (kind == Remark::unmodelled && imported.best.check.light != Light::green) continue;
    for (const std::string& text : texts) {
      if (kind == Remark::open && !text.starts_with("whether ")) continue;
      all.push_back(kind == Remark::undecided ? concat("The recording leaves open whether ", text, ".")
                    : kind == Remark::open    ? concat("Uncertain: ", text, ".")
                                              : text);
    }
  }
  return all;
}

}  // namespace

GraphComments import_comments(const Imported& imported) {
  const tracing::System& system = imported.recorded.system;
  GraphComments comments;
  comments.header = concat(
      "Imported from a trace of ros2_tracing; see import.md.\n"
      "Recorded executor: ",
      imported.best.executor.label, ".");
  for (const InferredRule& rule : imported.found.graph.rules) {
    for (const std::string& publisher : publishers_of(imported.found.graph, rule)) {
      std::string& text = comments.of[publisher];
      text += concat(text.empty() ? "" : "; ", system.topics[rule.topic].name, " ", rule_text(system, rule),
                     ": explains ", rule.explained, " of ", rule.jobs, " jobs");
    }
  }
  return comments;
}

json import_json(const Imported& imported) {
  const tracing::System& system = imported.system;
  const Reproduction& best = imported.best;
  const MeasuredCost delivery = measured_delivery(best.costs);
  json tried = json::array();
  for (const auto& [label, similarity] : best.tried)
    tried.push_back({{"executor", label}, {"similarity", similarity}});
  return {{"trace", imported.options.trace},
          {"version", HOTPATH_VERSION},
          {"events", imported.reading.events},
          {"all_events", imported.reading.all_events},
          {"duration_s", to_s(imported.reading.length())},
          {"jobs", imported.jobs()},
          {"window_jobs", imported.recorded.jobs.size()},
          {"warnings", warnings(imported)},
          {"processes", system.processes.size()},
          {"tracetools_version", system.rcl_version},
          {"executors", executors_json(imported)},
          {"tried", tried},
          {"execution_times", to_string(best.graph.platform.execution_times)},
          {"delivery",
           {{"n", delivery.n},
            {"least_us", to_us(delivery.least)},
            {"median_us", to_us(delivery.median)},
            {"p99_us", to_us(delivery.p99)},
            {"outliers", delivery.outliers},
            {"greatest_us", to_us(delivery.greatest)}}},
          {"deliveries", deliveries_json(system, imported.deliveries)},
          {"tasks", tasks_json(imported)},
          {"rules", rules_json(imported)},
          {"left_out", left_out_json(imported)},
          {"self_check", self_check_json(best.check)}};
}

void print_import(std::ostream& out, const Imported& imported) {
  const Reproduction& best = imported.best;
  const SelfCheck& check = best.check;
  const MeasuredCost delivery = measured_delivery(best.costs);
  std::vector<std::string> executors, light = check.reasons, uncertain = defects(imported), missing;
  if (const std::vector<std::string> named = left_out_json(imported)["named"]; !named.empty())
    missing.push_back("left out: " + first_of(named, ", "));
  for (std::size_t e = 0; e < best.labels.size(); ++e) {
    const Recognition& r = imported.recognitions[e];
    if (r.verdict == Verdict::recognised || r.verdict == Verdict::tie)
      executors.push_back(concat(imported.recorded.executors[e].name, ": ", first_of(r.names(), ", "), " (",
                                 to_string(r.verdict), ")"));
  }
  for (const auto& [to, kind] : {std::pair(&uncertain, Remark::open),
                                 {&uncertain, Remark::assumed},
                                 {&missing, Remark::missing},
                                 {&missing, Remark::unmodelled}})
    if (const auto of = imported.remarks.find(kind); of != imported.remarks.end())
      std::ranges::copy(of->second, std::back_inserter(*to));
  for (const auto& chain : check.chains)
    if (std::isfinite(chain.recorded_ms.p50) && std::isfinite(chain.simulated_ms.p50))
      light.push_back(program::text("%s median %.2f ms recorded, %.2f simulated (%+.1f %%%s)",
                                    chain.chain.c_str(), chain.recorded_ms.p50, chain.simulated_ms.p50,
                                    chain.median_error_percent,
                                    chain.between_modes ? ", between two modes" : ""));
  const std::string folder = imported.options.output,
                    now = best.executor.entry ? best.executor.label : folder + "/deployment.yaml";
  out << "Recognised: " << best.graph.nodes.size() << " nodes, " << best.tasks.set.size() << " tasks, "
      << imported.jobs() << " jobs in " << program::fixed(to_s(imported.reading.length()), 1)
      << " s; executors: " << first_of(executors) << "\nUncertain: " << first_of(uncertain)
      << "\nMissing: " << first_of(missing)
      << (delivery.n == 0 ? ""
                          : program::text("\nDelivery: median %.1f us, p99 %.1f us, greatest %.1f us (%zu "
                                          "samples that a sleeping thread took)",
                                          to_us(delivery.median), to_us(delivery.p99),
                                          to_us(delivery.greatest), delivery.n))
      << "\nReproduction: " << to_string(check.light) << " (order of jobs "
      << program::fixed(check.schedule.similarity, 3) << " similar)"
      << (light.empty() ? "" : "; " + first_of(light)) << "\nNext: "
      << (check.light == Light::red ? concat("read ", folder, "/import.md")
                                    : concat("hotpath advise ", folder, "/graph.yaml --now ", now))
      << '\n';
}

}  // namespace hotpath::imports
