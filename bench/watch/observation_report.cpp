// SPDX-License-Identifier: Apache-2.0
#include "watch/observation_report.hpp"

#include "hotpath/core/time.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

using tracing::CallbackKind;

std::string node_of(const tracing::System& system, const tracing::Callback& callback) {
  return callback.node < system.nodes.size() ? system.nodes[callback.node] : "(unknown node)";
}

std::string shown_ms(Duration duration) {
  return duration < Duration::zero() ? "-" : program::fixed(to_ms(duration), 3);
}

nlohmann::json stored_ms(Duration p99, Duration max) {
  if (max < Duration::zero()) return nullptr;
  return {{"p99", to_ms(p99)}, {"max", to_ms(max)}};
}

nlohmann::json fields_of(const tracing::System& system, const tracing::Callback& callback) {
  nlohmann::json fields{{"node", node_of(system, callback)}};
  switch (callback.kind) {
    case CallbackKind::timer:
      fields["kind"] = "timer";
      fields["period_ms"] = to_ms(callback.period);
      break;
    case CallbackKind::subscription:
      fields["kind"] = "subscription";
      fields["topic"] = system.topics[callback.topic].name;
      break;
    case CallbackKind::service:
      fields["kind"] = "service";
      break;
    case CallbackKind::client:
    case CallbackKind::unannounced:
    case CallbackKind::unknown:
      fields["kind"] = "unknown";
      break;
  }
  return fields;
}

}  // namespace

std::string shown_name(const tracing::System& system, std::uint32_t callback) {
  const tracing::Callback& of = system.callbacks[callback];
  const std::string node = node_of(system, of);
  switch (of.kind) {
    case CallbackKind::timer:
      return program::concat(node, " (timer ", to_ms(of.period), " ms)");
    case CallbackKind::subscription:
      return node + " " + system.topics[of.topic].name;
    case CallbackKind::service:
      return "(service)";
    case CallbackKind::client:
    case CallbackKind::unannounced:
    case CallbackKind::unknown:
      break;
  }
  return "(unknown callback)";
}

void ObservationReport::update(const Observer& observer, const Session& session, Duration now) {
  const double seconds = to_ms(now - now_) / 1000;
  rows_.clear();
  jobs_before_.resize(observer.callbacks().size());
  for (std::uint32_t c = 0; c < observer.callbacks().size(); ++c) {
    const CallbackObservation& observed = observer.callbacks()[c];
    if (observed.jobs + observed.lost == 0) continue;
    Row& row = rows_.emplace_back();
    row.name = shown_name(observer.system(), c);
    row.fields = fields_of(observer.system(), observer.system().callbacks[c]);
    row.rate = seconds > 0 ? static_cast<double>(observed.jobs - jobs_before_[c]) / seconds : 0;
    row.jobs = jobs_before_[c] = observed.jobs;
    row.lost = observed.lost;
    row.execution_p99 = observed.execution.quantile(0.99);
    row.execution_max = observed.execution.max();
    row.response_p99 = observed.response.quantile(0.99);
    row.response_max = observed.response.max();
  }
  now_ = now;
  events_ = observer.events();
  ignored_ = observer.ignored();
  threads_ = session.threads();
  processes_ = observer.system().processes.size();
  losses_ = session.losses();
}

program::TextTable ObservationReport::table() const {
  std::string title =
      program::text("%.0f s: %llu processes with nodes, %llu threads, %llu events", to_ms(now_) / 1000,
                    static_cast<unsigned long long>(processes_), static_cast<unsigned long long>(threads_),
                    static_cast<unsigned long long>(events_));
  for (const auto& [count, meaning] :
       {std::pair(losses_.dropped, "dropped"), std::pair(losses_.damaged, "damaged"),
        std::pair(losses_.late, "late"), std::pair(ignored_, "ignored")}) {
    if (count > 0) title += program::concat(", ", count, " ", meaning);
  }
  program::TextTable table(title, {"callback", "jobs/s", "jobs", "lost", "execution\np99 ms",
                                   "execution\nmax ms", "response\np99 ms", "response\nmax ms"});
  for (const Row& row : rows_) {
    table.add_row({row.name, program::fixed(row.rate, 1), program::concat(row.jobs),
                   program::concat(row.lost), shown_ms(row.execution_p99), shown_ms(row.execution_max),
                   shown_ms(row.response_p99), shown_ms(row.response_max)});
  }
  return table;
}

nlohmann::json ObservationReport::json() const {
  nlohmann::json callbacks = nlohmann::json::array();
  for (const Row& row : rows_) {
    nlohmann::json& callback = callbacks.emplace_back(row.fields);
    callback["rate"] = row.rate;
    callback["jobs"] = row.jobs;
    callback["lost"] = row.lost;
    callback["execution_ms"] = stored_ms(row.execution_p99, row.execution_max);
    callback["response_ms"] = stored_ms(row.response_p99, row.response_max);
  }
  return {{"time_s", to_ms(now_) / 1000}, {"processes", processes_},
          {"threads", threads_},          {"events", events_},
          {"dropped", losses_.dropped},   {"damaged", losses_.damaged},
          {"late", losses_.late},         {"ignored_entities", ignored_},
          {"callbacks", callbacks}};
}

}  // namespace hotpath::watch
