// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hotpath {

/// From now on SIGINT and SIGTERM ask for an orderly end; a second one kills as usual.
void catch_interrupts();

/// The signal that asked for an end; 0: none so far.
int interrupted();

}  // namespace hotpath
