// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath {

/// From now on SIGINT and SIGTERM ask for an orderly end. Another one kills as usual, unless it comes within
/// a second: a program that forwards a terminal's signal, as timeout(1) does, sends it twice.
void catch_interrupts();

/// The signal that asked for an end; 0: none so far.
int interrupted();

}  // namespace hotpath
