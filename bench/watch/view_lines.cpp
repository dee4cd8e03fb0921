// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "hotpath/core/utf8.hpp"
#include "program/text.hpp"
#include "watch/live_view.hpp"

namespace hotpath::watch {

namespace {

constexpr std::size_t kNameWidth = 40;

std::string shown_nearness(double nearness) {
  return nearness < 0 ? "-" : program::fixed(100 * nearness, 0) + " %";
}

/// A name that takes kNameWidth bytes or less on the screen.
std::string padded(const std::string& name) {
  std::string text = printable(name, kNameWidth);
  text.resize(std::max(text.size(), kNameWidth), ' ');
  return text;
}

std::string columns(const std::vector<std::string>& values) {
  std::string text;
  for (const std::string& value : values) text += program::text("%11s", value.c_str());
  return text + "  ";
}

/// The rows in the order of the key.
std::vector<const ObservationReport::Row*> sorted(const std::vector<ObservationReport::Row>& rows,
                                                  SortKey key) {
  std::vector<const ObservationReport::Row*> order;
  for (const ObservationReport::Row& row : rows)
    if (!row.housekeeping) order.push_back(&row);
  std::ranges::stable_sort(order, [&](const auto* a, const auto* b) {
    switch (key) {
      case SortKey::nearness:
        return a->nearness > b->nearness;
      case SortKey::execution:
        return a->execution_max > b->execution_max;
      case SortKey::rate:
        return a->rate > b->rate;
      case SortKey::name:
        break;
    }
    return a->name < b->name;
  });
  return order;
}

}  // namespace

std::string sparkline(const std::deque<double>& values) {
  static constexpr std::array kBars = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double largest = values.empty() ? 0 : *std::ranges::max_element(values);
  std::string text;
  for (const double value : values) {
    const double share = largest > 0 ? value / largest : 0;
    const auto bar = static_cast<std::size_t>(std::clamp(share * 8, 0.0, 7.0));
    text += value < 0 ? " " : kBars[bar];
  }
  return text;
}

void ViewLines::remember(const ObservationReport& report) {
  const auto add = [&](const std::string& name, Duration worst) {
    std::deque<double>& values = history_[name];
    values.push_back(worst < Duration::zero() ? -1 : to_ms(worst));
    if (values.size() > kSeconds) values.pop_front();
  };
  for (const ObservationReport::Row& row : report.rows()) add(row.name, row.latest);
  for (const ObservationReport::ChainRow& row : report.chains()) add("chain " + row.name, row.latest);
}

std::string ViewLines::history_of(const std::string& name) const {
  const auto at = history_.find(name);
  return at == history_.end() ? "" : sparkline(at->second);
}

std::vector<ViewLine> ViewLines::lines(const ObservationReport& report, SortKey key,
                                       const std::string& incident, const Selection& selection) const {
  std::vector<ViewLine> lines = {{report.title(), false, true}};
  if (!incident.empty()) lines.push_back({"Incident: " + printable(incident, 1000), true, false});
  for (const std::string& line : selection.explanation)
    lines.push_back({printable(line, 1000), false, false});
  if (!report.chains().empty()) {
    lines.push_back({padded("CHAIN") +
                         columns({"of limit", "outputs", "path p99", "path max", "age p99", "age max"}) +
                         "age, last minute",
                     false, true});
    std::vector<const ObservationReport::ChainRow*> order;
    for (const ObservationReport::ChainRow& row : report.chains()) order.push_back(&row);
    if (key == SortKey::nearness)
      std::ranges::stable_sort(order, std::greater(), [](const auto* row) { return row->nearness; });
    for (const auto* row : order) {
      lines.push_back({padded((row->name == selection.chain ? "> " : "") + row->name) +
                           columns({shown_nearness(row->nearness), program::concat(row->outputs),
                                    shown_ms(row->hot_path_p99), shown_ms(row->hot_path_max),
                                    shown_ms(row->age_p99), shown_ms(row->age_max)}) +
                           history_of("chain " + row->name),
                       row->nearness > 1, false});
    }
  }
  lines.push_back({padded("CALLBACK") +
                       columns({"of limit", "jobs/s", "lost", "run p99", "run max", "resp. max"}) +
                       "run, last minute",
                   false, true});
  for (const ObservationReport::Row* row : sorted(report.rows(), key)) {
    lines.push_back({padded(row->name) +
                         columns({shown_nearness(row->nearness), program::fixed(row->rate, 1),
                                  program::concat(row->lost), shown_ms(row->execution_p99),
                                  shown_ms(row->execution_max), shown_ms(row->response_max)}) +
                         history_of(row->name),
                     row->nearness > 1, false});
  }
  lines.push_back(
      {padded("THREAD") + columns({"process", "thread", "policy", "processors", "CPU ms/s", "wait ms/s"}),
       false, true});
  for (const ObservationReport::ThreadRow& row : report.executor_threads()) {
    const std::string name =
        row.executor.empty() ? row.facts.name : row.executor + " (" + row.facts.name + ")";
    lines.push_back(
        {padded(name) + columns({program::concat(row.facts.process), program::concat(row.facts.thread),
                                 to_string(row.facts.policy), shown_processors(row.facts.processors),
                                 program::fixed(row.ran, 1), program::fixed(row.waited, 1)}),
         row.original.has_value(), false});
  }
  return lines;
}

}  // namespace hotpath::watch
