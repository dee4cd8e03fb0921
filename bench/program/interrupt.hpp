// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::program {

/// From now on SIGINT and SIGTERM request an orderly end. A second signal kills as usual, unless it
/// arrives within a second: a program that forwards a terminal's signal, such as timeout(1), sends
/// it twice.
void catch_interrupts();

/// The signal that requested the end; 0: none so far.
int interrupted();

}  // namespace hotpath::program
