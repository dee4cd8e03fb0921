// SPDX-License-Identifier: Apache-2.0
#include "program/text.hpp"
#include "results/process_usage.hpp"

namespace hotpath::results {
namespace {

/// Three ticks of the kernel's clock: less says nothing.
constexpr Duration kLeast = std::chrono::milliseconds(30);

struct Limit {
  Duration ProcessUsage::*time;
  double percent;  ///< Of the length of the repetition.
  const char* words;
};
constexpr Limit kLimits[] = {{&ProcessUsage::stolen, 0.5, "stolen by the hypervisor"},
                             {&ProcessUsage::throttled, 0.5, "throttled by a quota or by heat"},
                             {&ProcessUsage::others, 5, "used by other processes"}};

}  // namespace

std::vector<std::string> disturbances(const ProcessUsage& usage) {
  std::vector<std::string> marks;
  if (usage.wall <= Duration::zero()) return marks;
  for (const Limit& limit : kLimits) {
    const Duration time = usage.*limit.time;
    const double percent = usage.percent(time);
    if (time < kLeast || percent <= limit.percent) continue;
    marks.push_back(program::text("%.1f %% of the time %s", percent, limit.words));
  }
  return marks;
}

}  // namespace hotpath::results
