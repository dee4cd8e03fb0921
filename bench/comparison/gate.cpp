// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "comparison/report.hpp"
#include "hotpath/core/utf8.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::comparison {

namespace {

using program::text;

bool is_worse(const Judgement& j) { return j.verdict() == Verdict::worse; }

/// A detectable growth; few noisy repetitions can make it very large.
std::string percent_text(double value) {
  return value > 1000 ? "over 1000 %" : text(value >= 10 ? "%.0f %%" : "%.1f %%", value);
}

std::string effect_text(const Judgement& j) {
  return j.counted() ? text("%+.3g", j.test.growth) : text("%+.1f %%", j.percent());
}

/// The interval in the unit of the effect.
std::string interval_text(const Judgement& j) {
  const auto& [low, high] = j.test.interval;
  if (std::isnan(low)) return j.exact() ? "exact" : "";
  if (j.counted()) return text("[%+.3g, %+.3g]", low, high);
  return text("[%+.1f, %+.1f] %%", 100 * (low - 1), 100 * (high - 1));
}

std::string detectable_text(const Judgement& j) {
  if (j.test.exact && (j.exact() || j.counted())) return "any";
  return j.counted() ? text("%.3g", j.detectable) : percent_text(j.detectable_percent());
}

constexpr std::pair<Pairing, const char*> kMethods[] = {
    {Pairing::exact, "simulated repetitions of equal draws pair by pair"},
    {Pairing::paired, "interleaved repetitions pair by pair"},
    {Pairing::independent, "independent repetitions"}};

/// With ten decimals, which suffice for nanoseconds.
double rounded(double value) {
  if (!std::isfinite(value)) return value;
  return std::strtod(text(std::abs(value) < 1e-15 ? "%.10g" : "%.10f", value).c_str(), nullptr);
}

std::string attribute(const char* name, const std::string& value) {
  std::string escaped;
  for (const char c : printable(value)) {
    const char* const entity = c == '&'   ? "&amp;"
                               : c == '<' ? "&lt;"
                               : c == '>' ? "&gt;"
                               : c == '"' ? "&quot;"
                                          : nullptr;
    entity == nullptr ? escaped += c : escaped += entity;
  }
  return program::concat(" ", name, "=\"", escaped, "\"");
}

}  // namespace

program::Table rows_of(const std::vector<Judgement>& judgements, bool worst_first) {
  std::vector<Judgement> sorted = judgements;
  if (worst_first) std::ranges::stable_partition(sorted, is_worse);
  program::Table table(
      "", {"", "measure", "old", "new", "effect", "95 % interval", "p (Holm)", "would find", ""});
  for (const Judgement& j : sorted) {
    const char* const format = j.counted() ? "%.4g" : "%.3f";
    table.add_row({j.what, to_string(j.measure), text(format, j.test.before), text(format, j.test.after),
                   effect_text(j), interval_text(j),
                   j.dried_up || j.sprang_up ? "0" : text("%.2g", j.adjusted), detectable_text(j),
                   to_string(j.verdict())});
  }
  return table;
}

std::string verdict_of(const std::map<Verdict, std::size_t>& verdicts, const std::string& things) {
  std::vector<std::string> counts;
  std::size_t all = 0;
  for (const auto& [verdict, n] : verdicts) {
    all += n;
    counts.push_back(program::concat(n, " ", to_string(verdict)));
  }
  const bool both = verdicts.contains(Verdict::worse) && verdicts.contains(Verdict::better);
  return program::concat(both ? "partly " : "", to_string(verdicts.begin()->first), " (",
                         verdicts.size() == 1 ? "all" : program::joined(counts) + "; of", " ", all, " ",
                         things);
}

std::string verdict_of(const std::vector<Judgement>& judgements) {
  std::vector<std::string> how;
  for (const auto& [pairing, method] : kMethods) {
    if (std::ranges::count(judgements, pairing, &Judgement::pairing) > 0) how.emplace_back(method);
  }
  std::map<Verdict, std::size_t> verdicts;
  for (const Judgement& j : judgements) ++verdicts[j.verdict()];
  return program::concat("Overall: ", verdict_of(verdicts, "measures"), "; ", program::joined(how, " and "),
                         "; at most ", 100 * kAlarmRate, " % false alarms)");
}

std::string power_of(const std::vector<Judgement>& judgements) {
  const std::string exact = "In simulated pairs that agree, any growth is found.";
  std::vector<double> noisy;
  bool all = true, seeds = false;  // all latencies are noisy; equal seeds would make pairs
  for (const Judgement& j : judgements) {
    if (!j.counted() && !j.exact()) noisy.push_back(j.detectable_percent());
    all = all && (j.counted() || !j.exact());
    seeds = seeds || (j.simulated && j.pairing == Pairing::independent);
  }
  if (noisy.empty()) return exact;
  std::ranges::sort(noisy);
  const double middle = quantile(noisy, 0.5);
  return program::concat(
      all ? "" : exact + " ", "With these repetitions, a growth of ", percent_text(middle),
      " would be found in the typical latency",
      noisy.back() > 1.05 * middle ? " (" + percent_text(noisy.back()) + " in the noisiest one)" : "",
      " with a probability of ", 100 * kPower, " %.",
      seeds ? " Simulate both with the same --seed to compare pair by pair." : "");
}

nlohmann::json json_of(const std::vector<Judgement>& judgements) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Judgement& j : judgements) {
    rows.push_back({{"what", j.what},
                    {"measure", to_string(j.measure)},
                    {"before", rounded(j.test.before)},
                    {"after", rounded(j.test.after)},
                    {"growth", rounded(j.test.growth)},
                    {"interval_low", rounded(j.test.interval.low)},
                    {"interval_high", rounded(j.test.interval.high)},
                    {"p_adjusted", rounded(j.adjusted)},
                    {"verdict", to_string(j.verdict())},
                    {"worse", is_worse(j)}});
  }
  return rows;
}

std::string junit_of(const std::vector<Judgement>& judgements) {
  const auto number = [](auto n) { return std::to_string(n); };
  std::string xml = "<?xml version='1.0' encoding='utf-8'?>\n<testsuites><testsuite name=\"hotpath gate\"" +
                    attribute("tests", number(judgements.size())) +
                    attribute("failures", number(std::ranges::count_if(judgements, is_worse))) + ">";
  for (const Judgement& j : judgements) {
    xml += "<testcase" + attribute("classname", j.what) + attribute("name", to_string(j.measure));
    if (is_worse(j)) {
      const std::string said = text("%.3f before, %.3f now: %s %s, p = %.2g", j.test.before, j.test.after,
                                    effect_text(j).c_str(), interval_text(j).c_str(), j.adjusted);
      xml += "><failure" + attribute("message", said) + " /></testcase>";
    } else {
      xml += " />";
    }
  }
  return xml + "</testsuite></testsuites>\n";
}

std::string markdown_of(const std::vector<Judgement>& judgements, const Options& options) {
  return program::concat("### ", verdict_of(judgements), "\n\n", program::markdown(options.old.string()),
                         " against ", program::markdown(options.now.string()), "\n\n",
                         markdown_of(rows_of(judgements, true), {1, 2, 3, 4, 5, 6, 7, 8}), "\n",
                         power_of(judgements), "\n");
}

}  // namespace hotpath::comparison
