// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/buttazzo_2013.hpp"

#include <algorithm>

#include "busy_window.hpp"

namespace hotpath {

ResponseTimes buttazzo_2013(const SequenceTasks& tasks, TimeModel model) {
  constexpr std::string_view kMethod = "limited preemption (buttazzo_2013)";
  check_sequences(tasks, kMethod, true);
  for (const SequenceTask& s : tasks) {
    if (s.suspension != 0) {
      throw AnalysisError("sequence '" + s.name + "': suspension of " + std::to_string(s.suspension) +
                          " ns, which " + std::string(kMethod) +
                          " does not allow; chen_2019 (self-suspension) would");
    }
  }
  std::vector<std::int64_t> longest_lower(tasks.size(), 0);
  for (std::size_t k = tasks.size() - 1; k > 0; --k) {
    longest_lower[k - 1] = std::max(longest_lower[k], tasks[k].longest_segment());
  }
  Interference higher;
  exact::Utilisation utilisation;
  ResponseTimes bounds;
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    const SequenceTask& s = tasks[k];
    utilisation.add(s.wcet(), s.period);
    const LevelTask level = {.wcet = s.wcet(),
                             .period = s.period,
                             .last_part = s.segments.back(),
                             .longest_lower = longest_lower[k]};
    bounds.push_back(busy_window_response(level, higher, utilisation, model));
    higher.add(s.wcet(), s.period, 0);
  }
  return bounds;
}

}  // namespace hotpath
