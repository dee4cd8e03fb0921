// SPDX-License-Identifier: Apache-2.0
// Without ncurses.
#include "watch/live_view.hpp"

namespace hotpath::watch {

std::unique_ptr<LiveView> open_live_view() { return nullptr; }

}  // namespace hotpath::watch
