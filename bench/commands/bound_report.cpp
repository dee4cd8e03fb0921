// SPDX-License-Identifier: Apache-2.0
#include "commands/bound_report.hpp"

#include <iostream>

#include "hotpath/analysis/tightness.hpp"
#include "program/text.hpp"

namespace hotpath {

std::string in_ms(const std::optional<Duration>& d) { return d ? fixed(to_ms(*d), 3) : "-"; }

void BoundReport::print(const BoundSet& set) {
  std::cout << "\n" << set.executor << ", " << set.method << "\n";
  if (!set.refusal.empty()) {
    std::cout << "does not apply: " << set.refusal << "\n";
    return;
  }
  if (!set.tasks.empty()) {
    print_tasks(set);
    print_verdict(set);
  }
  if (!set.chains.empty()) print_chains(set);
}

std::string BoundReport::csv() const {
  return "executor,method,kind,name,bound_ns,observed_ns,tightness,violated\n" + csv_.str();
}

TextTable BoundReport::table(const std::string& what, std::vector<std::string> more) const {
  std::vector<std::string> header = {what, "bound ms"};
  header.insert(header.end(), more.begin(), more.end());
  if (observed_) header.insert(header.end(), {"observed ms", "tightness", ""});
  return TextTable("", std::move(header));
}

void BoundReport::print_tasks(const BoundSet& set) {
  TextTable rows = table("task", {"deadline"});
  for (TaskId id = 0; id < tasks_.set.size(); ++id) {
    const Task& task = tasks_.set[id];
    const auto observed = observed_ ? observed_->task(set.executor, task.name) : std::nullopt;
    std::vector<TextTable::Cell> cells = {task.name, in_ms(set.tasks[id]),
                                          task.kind == TaskKind::timer ? in_ms(task.deadline) : ""};
    add_row(rows, std::move(cells), set, {"task", task.name, set.tasks[id], observed});
  }
  std::cout << rows;
}

void BoundReport::print_chains(const BoundSet& set) {
  TextTable rows = table("chain, end to end", {});
  for (std::size_t c = 0; c < set.chains.size(); ++c) {
    const std::string& name = graph_.chains[c].name;
    const auto observed = observed_ ? observed_->chain(set.executor, name) : std::nullopt;
    add_row(rows, {name, in_ms(set.chains[c])}, set, {"chain", name, set.chains[c], observed});
  }
  std::cout << rows;
}

void BoundReport::add_row(TextTable& rows, std::vector<TextTable::Cell> cells, const BoundSet& set,
                          const Row& row) {
  const auto count = [](std::optional<Duration> d) {
    return d ? std::optional<std::int64_t>(d->count()) : std::nullopt;
  };
  Tightness t{row.name, count(row.bound), count(row.observed), std::nullopt, false};
  const bool comparable = !row.bound || *row.bound > Duration::zero();
  if (comparable) t = compare_with_bounds({{t.name, t.bound, t.observed}}).rows.front();
  violations_ += t.violated;
  if (observed_) {
    cells.insert(cells.end(),
                 {in_ms(row.observed), t.ratio ? fixed(*t.ratio, 3) : "-", t.violated ? "VIOLATED" : ""});
  }
  rows.add_row(std::move(cells));
  const auto field = [&](const auto& value) {
    if (value) csv_ << *value;
    csv_ << ',';
  };
  csv_ << set.executor << ',' << set.method << ',' << row.kind << ',' << row.name << ',';
  field(t.bound);
  field(t.observed);
  field(t.ratio);
  csv_ << (t.violated ? "yes" : "no") << '\n';
}

void BoundReport::print_verdict(const BoundSet& set) const {
  for (TaskId id = 0; id < tasks_.set.size(); ++id) {
    const Task& task = tasks_.set[id];
    if (task.kind != TaskKind::timer) continue;
    if (!set.tasks[id] || *set.tasks[id] > task.deadline) {
      std::cout << "Not shown schedulable: " << task.name << " may exceed its deadline.\n";
      return;
    }
  }
  std::cout << "Schedulable: every timer meets its deadline.\n";
}

}  // namespace hotpath
