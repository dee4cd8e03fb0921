// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "hotpath/core/utf8.hpp"
#include "program/text.hpp"
#include "watch/live_view.hpp"

namespace hotpath::watch {

namespace {

using Row = ObservationReport::Row;

constexpr std::size_t kNameWidth = 40;

/// A name that takes kNameWidth bytes or less on the screen.
std::string padded(const std::string& name) {
  std::string text = printable(name, kNameWidth);
  text.resize(std::max(text.size(), kNameWidth), ' ');
  return text;
}

std::string column(const std::string& value) { return program::text("%11s", value.c_str()); }

/// A field in ms or a rate; -1: there is none.
double number(const Row* row, const char* path) {
  const nlohmann::json::json_pointer field(path);
  return row->fields.contains(field) ? row->fields.at(field).get<double>() : -1;
}

/// The rows in the order of the key. Chains have an order of their own, unless one is near to breaking.
std::vector<const Row*> sorted(const ObservationReport& report, const ObservationReport::Section& section,
                               SortKey key) {
  std::vector<const Row*> order;
  for (const Row& row : section.rows)
    if (!row.housekeeping) order.push_back(&row);
  const bool callbacks = &section == &report.callbacks();
  if (!callbacks && (key != SortKey::nearness || &section == &report.threads())) return order;
  std::ranges::stable_sort(order, [&](const Row* a, const Row* b) {
    switch (key) {
      case SortKey::nearness:
        return a->nearness > b->nearness;
      case SortKey::execution:
        return number(a, "/execution_ms/max") > number(b, "/execution_ms/max");
      case SortKey::rate:
        return number(a, "/rate") > number(b, "/rate");
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
  for (const auto* section : {&report.callbacks(), &report.chains()}) {
    for (const Row& row : section->rows) {
      std::deque<double>& values = history_[{section->key, row.name}];
      values.push_back(row.latest < Duration::zero() ? -1 : to_ms(row.latest));
      if (values.size() > kSeconds) values.pop_front();
    }
  }
}

std::vector<ViewLine> ViewLines::lines(const ObservationReport& report, SortKey key,
                                       const std::string& incident, const Selection& selection) const {
  std::vector<ViewLine> lines = {{report.title(), false, true}};
  if (!incident.empty()) lines.push_back({"Incident: " + printable(incident, 1000), true, false});
  for (const std::string& line : selection.explanation)
    lines.push_back({printable(line, 1000), false, false});
  for (const auto* section : {&report.chains(), &report.callbacks(), &report.threads()}) {
    const bool chains = section == &report.chains(), has_history = *section->history != '\0';
    if (chains && section->rows.empty()) continue;
    std::string heading = padded(section->heading) + (has_history ? column("of limit") : "");
    for (const auto& shown : section->columns) heading += *shown.title == '\0' ? "" : column(shown.title);
    lines.push_back({heading + "  " + section->history, false, true});
    for (const Row* row : sorted(report, *section, key)) {
      std::string text = padded((chains && row->name == selection.chain ? "> " : "") + row->name);
      if (has_history)
        text += column(row->nearness < 0 ? "-" : program::fixed(100 * row->nearness, 0) + " %");
      for (const auto& shown : section->columns)
        if (*shown.title != '\0') text += column(ObservationReport::shown(*row, shown));
      const auto history = history_.find({section->key, row->name});
      lines.push_back({text + "  " + (history == history_.end() ? "" : sparkline(history->second)),
                       row->nearness > 1, false});
    }
  }
  return lines;
}

}  // namespace hotpath::watch
