// SPDX-License-Identifier: Apache-2.0
#include "sweep/capacity.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/enum_text.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::sweep {

std::size_t Levels::count() const { return static_cast<std::size_t>((high - low) / step + 1e-9) + 1; }

double Levels::at(std::size_t index) const {
  return std::stod(program::text("%.12g", low + static_cast<double>(index) * step));
}

std::vector<std::size_t> Capacity::again() const {
  std::vector<std::size_t> levels;
  bool failed = false;
  for (const auto& [level, failure] : tried) {
    failed = failed || failure;
    if (failed && !failure) levels.push_back(level);
  }
  return levels;
}

Capacity find_capacity(const Levels& levels, std::size_t coarse,
                       const std::function<std::optional<std::string>(double)>& failure) {
  Capacity capacity;
  const auto holds = [&](std::size_t level) {
    const auto [at, added] = capacity.tried.try_emplace(level);
    if (added) at->second = failure(levels.at(level));
    return !at->second;
  };
  const std::size_t last = levels.count() - 1;
  std::optional<std::size_t> below, above;  // the first level that failed, and the last before it that held
  for (std::size_t i = 0; i < std::max<std::size_t>(coarse, 2); ++i) {
    const std::size_t level = i * last / (std::max<std::size_t>(coarse, 2) - 1);
    if (!holds(level)) {
      if (!above) above = level;
    } else if (!above) {
      below = level;
    }
  }
  while (below && above && *above - *below > 1) {
    const std::size_t middle = *below + (*above - *below) / 2;
    (holds(middle) ? below : above) = middle;
  }
  capacity.highest = below;
  return capacity;
}

Requirement Requirement::parse(const std::vector<std::string>& words) {
  Requirement r{.words = words};
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find(':') + 1);
    if (word == "no-loss") {
      r.no_loss = true;
    } else if (word == "deadlines") {
      r.deadlines = true;
    } else if (name == "age:" || name == "latency:") {
      std::optional<double>& limit_ms = name == "age:" ? r.age_ms : r.latency_ms;
      limit_ms = hotpath::parse<double>(std::string_view(word).substr(name.size()));
      if (!(limit_ms > 0.0))
        throw program::UsageError(
            program::concat("--require: `", word, "` has no limit; write ", name, "60 for 60 ms"));
    } else {
      throw program::UsageError("--require: `" + word + "` is not no-loss, deadlines, age:MS or latency:MS");
    }
  }
  return r;
}

std::optional<std::string> Requirement::failure(const results::ExecutorSummary& executor) const {
  using Each = results::RepetitionMeasures;
  const std::vector<Each>& each = executor.each;
  if (each.empty()) return "nothing was measured";
  struct Condition {
    bool required;
    std::function<bool(const Each&)> fails;
    std::string why;
  };
  const auto most = [&](auto of) { return of(*std::ranges::max_element(each, {}, of)); };
  const std::uint64_t never_ran = most([](const Each& r) { return r.never_ran; });
  std::vector<Condition> conditions = {
      {no_loss, [](const Each& r) { return r.lost() > 0; },
       program::concat(executor.skipped, " timestamps skipped, ", executor.overwritten,
                       " samples overwritten")},
      {deadlines, [](const Each& r) { return r.deadline_overruns > 0; },
       program::concat(executor.after_warm_up.deadline_overruns, " deadlines missed")},
      {true, [](const Each& r) { return r.never_ran > 0; },
       never_ran == 1 ? "a task never ran" : program::concat(never_ran, " tasks never ran")}};
  for (std::size_t c = 0; (age_ms || latency_ms) && c < executor.chains.size(); ++c) {
    conditions.push_back({true, [c](const Each& r) { return r.chains[c].outputs == 0; },
                          "no output of chain " + executor.chains[c].chain});
    const auto limit = [&](const char* name, double Each::OfChain::*of, std::optional<double> limit_ms) {
      const auto worst = [c, of](const Each& r) { return r.chains[c].*of; };
      conditions.push_back({limit_ms.has_value(), [=](const Each& r) { return !(worst(r) <= *limit_ms); },
                            program::text("%s %.1f ms", name, most(worst))});
    };
    limit("age", &Each::OfChain::worst_age_ms, age_ms);
    limit("latency", &Each::OfChain::worst_hot_path_ms, latency_ms);
  }
  for (const auto& [required, fails, why] : conditions) {
    const auto count = required ? std::ranges::count_if(each, fails) : 0;
    if (count == 0) continue;
    return each.size() == 1 ? why : program::concat(why, " (", count, " of ", each.size(), " repetitions)");
  }
  return std::nullopt;
}

}  // namespace hotpath::sweep
