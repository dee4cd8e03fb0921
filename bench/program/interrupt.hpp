// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath::program {

/// From now on SIGINT and SIGTERM request an orderly end. A second signal kills as usual, unless it
/// arrives within a second: a program that forwards a terminal's signal, such as timeout(1), sends
/// it twice.
void catch_interrupts();

/// Until catch_interrupts(), SIGINT and SIGTERM end the program with this line on standard error, which must
/// live as long, and exit code 128 + signal.
void end_on_interrupt(const char* line);

/// The signal that requested the end; 0: none so far.
int interrupted();

}  // namespace hotpath::program
