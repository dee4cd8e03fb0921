// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

namespace hotpath::program {

/// The file mode creation mask with which this process was started, for programs that it starts.
inline mode_t inherited_umask = 022;

/// From now on only the user may access new files and shared memory.
inline void restrict_new_files() {
  inherited_umask = umask(077);
  umask(inherited_umask | 077);
}

}  // namespace hotpath::program
