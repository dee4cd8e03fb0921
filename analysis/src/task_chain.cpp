// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/task_chain.hpp"

namespace hotpath {

void check_chain(const PeriodicTasks& tasks, const ResponseTimes& bounds, const TaskChain& chain,
                 std::string_view method) {
  const std::string prefix = std::string(method) + ": ";
  if (chain.empty()) throw AnalysisError(prefix + "the chain is empty; name at least one task");
  if (bounds.size() != tasks.size()) {
    throw AnalysisError(prefix + std::to_string(bounds.size()) + " response time bounds for " +
                        std::to_string(tasks.size()) + " tasks; give one for each");
  }
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const std::string where = "element " + std::to_string(i + 1) + " of the chain";
    if (chain[i] >= tasks.size()) {
      throw AnalysisError(prefix + where + " is task number " + std::to_string(chain[i]) +
                          ", but there are only " + std::to_string(tasks.size()));
    }
    if (!bounds[chain[i]]) {
      throw AnalysisError(prefix + where + ", " + task_label(tasks, chain[i]) +
                          ", has no response time bound; every end-to-end method needs one");
    }
  }
}

}  // namespace hotpath
