// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/suggestion.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <numeric>
#include <vector>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Levenshtein's edit distance.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::optional<std::string> nearest(std::string_view word, std::span<const std::string> candidates) {
  std::optional<std::string> best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t d = distance(word, candidate);
    if (d < best_distance && d < candidate.size()) {
      best = candidate;
      best_distance = d;
    }
  }
  return best;
}

std::string suggest(std::string_view word, std::span<const std::string> candidates) {
  if (const auto best = nearest(word, candidates)) return "did you mean `" + *best + "`?";
  if (candidates.empty()) return "none are available";
  std::vector<std::string> longer;
  if (word.size() > 1)
    std::ranges::copy_if(candidates, std::back_inserter(longer),
                         [&](const std::string& candidate) { return candidate.starts_with(word); });
  if (!longer.empty() && longer.size() < 4) return "did you mean `" + joined(longer, "` or `") + "`?";
  return "choose one of: " + joined(candidates, ", ");
}

}  // namespace hotpath
