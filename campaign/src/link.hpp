// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace hotpath {

/// Messages between ranks, in order between any two. Nothing here blocks, whatever became of the others.
class Link {
 public:
  struct Received {
    unsigned from;
    std::string bytes;
  };

  virtual ~Link() = default;
  [[nodiscard]] virtual unsigned rank() const = 0;
  [[nodiscard]] virtual unsigned ranks() const = 0;
  [[nodiscard]] virtual unsigned ranks_on_this_machine() const = 0;
  virtual void send(unsigned to, std::string bytes) = 0;
  virtual std::optional<Received> receive() = 0;
  /// From now on some rank may be dead: do not wait for all of them at the end.
  virtual void abandon() = 0;
};

/// nullptr: this process was not started as one of several ranks, or the build has no MPI.
std::unique_ptr<Link> make_mpi_link();

}  // namespace hotpath
