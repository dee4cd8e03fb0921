// SPDX-License-Identifier: Apache-2.0
#include "import/recognition.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

std::string share_of(const Score& score, const Recognition& r) {
  return program::text("%.1f %% of %zu contested decisions", 100 * score.agreement, r.contested);
}

std::string next_one(const Recognition& r) {
  if (r.ranking.size() == 1) return "; no other known executor has such threads.";
  if (r.leading >= r.ranking.size()) return ".";
  const Score& next = r.ranking[r.leading];
  return program::text("; the next one, %s, explains %.1f %%.", next.hypothesis.label.c_str(),
                       100 * next.agreement);
}

std::string tie(const Recognition& r) {
  const std::vector<std::string> unlikely = r.names(true);
  std::vector<std::string> likely = r.names();
  std::erase_if(likely, [&](const std::string& name) { return std::ranges::count(unlikely, name) > 0; });
  std::string all = program::concat(
      program::joined(likely, ", "),
      likely.size() == 1 ? " explains the recording best, " : " explain the recording equally well, ",
      share_of(r.ranking.front(), r));
  if (!unlikely.empty())
    all += program::concat("; ", program::joined(unlikely, ", "), " cannot be excluded, but ",
                           unlikely.size() == 1 ? "makes" : "make",
                           " the recording a thousand times less likely");
  return all + next_one(r);
}

std::string undecided(const Recognition& r, const std::string& names) {
  std::size_t differing = 0;
  for (const Score& score : std::span(r.ranking).first(r.leading))
    differing = std::max(differing, score.differing());
  const std::string known = r.contested == 0 ? "No" : program::concat("Only ", r.contested);
  return differing == 0 || r.contested < 20
             ? program::concat(known, " of ", r.decisions,
                               " judged decisions had a choice, too few to tell executors apart (possible: ",
                               names, "). Record at a load at which callbacks wait for each other.")
             : program::concat("The recording does not tell ", names, " apart: they differ in at most ",
                               differing, " of ", r.contested, " contested decisions.");
}

}  // namespace

std::string sentence(const Recognition& r) {
  if (r.ranking.empty()) return "No known executor runs such threads.";
  const std::string names = program::joined(r.names(), ", ");
  const Score& best = r.ranking.front();
  if (!r.stated.empty())
    return program::concat("The executor calls itself ", r.stated, ", which explains ", share_of(best, r),
                           ".");
  switch (r.verdict) {
    case Verdict::recognised:
      return program::concat(names, " explains ", share_of(best, r), next_one(r));
    case Verdict::tie:
      return tie(r);
    case Verdict::undecided:
      return undecided(r, names);
    case Verdict::none_fits:
      return program::concat("No known executor fits: the best one, ", best.hypothesis.label, ", explains ",
                             share_of(best, r), r.breaks.empty() ? "" : ". It first breaks ", r.breaks, ".");
  }
  return {};
}

nlohmann::json recognition_json(const Recognition& r) {
  using nlohmann::json;
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

}  // namespace hotpath::imports
