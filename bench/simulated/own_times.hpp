// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/trace.hpp"

namespace hotpath {

/// A measured trace in which finish - start is the time that each job had a core, for replaying jobs of fixed
/// work: its CPU time where that was measured; else, while more jobs had begun than there are cores, those of
/// the raised timer management thread (`raised`) count as running and the others share what is left.
Trace with_own_times(Trace trace, unsigned cores, bool raised);

}  // namespace hotpath
