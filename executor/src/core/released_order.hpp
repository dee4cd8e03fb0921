// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "hotpath/core/timer.hpp"

namespace hotpath {

/// ExploredScheduler::released_by() for timers with an order. `entries` are sorted by `before`, first of all
/// by the instant `due` of `timers[timer]`. Timestamps stay as they are: some schedule has this order.
template <class Entry, class Before>
void released_by(Time now, std::vector<Entry>& entries, std::vector<Timer>& timers, const Before& before) {
  for (std::size_t i = entries.size(); i-- > 0;) {
    Entry& entry = entries[i];
    Timer& timer = timers[entry.timer];
    if (!timer.is_released()) continue;
    entry.due = std::min(entry.due, now);
    if (i + 1 < entries.size() && !before(entry, entries[i + 1])) {
      entry.due = entries[i + 1].due;
      if (!before(entry, entries[i + 1])) entry.due -= Duration(1);
    }
    timer.release_at(entry.due);
  }
}

}  // namespace hotpath
