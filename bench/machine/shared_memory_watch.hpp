// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <set>
#include <string>

namespace hotpath {

/// Remembers which files of /dev/shm a process maps or has open, so that they can be removed when it dies
/// without doing so itself (Fast DDS's segments and their lock files outlive a killed process).
class SharedMemoryWatch {
 public:
  void note(pid_t process);
  /// Notes those of every process of a process group.
  void note_group(pid_t group);
  /// Removes the files noted that no living process uses.
  void remove_orphans() const;

 private:
  std::set<std::string> files_;
};

}  // namespace hotpath
