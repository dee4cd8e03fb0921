// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace hotpath {

/// Messages between ranks, ordered between any two ranks. No call blocks, whatever the state of the
/// other ranks.
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
  /// Some rank may be dead: do not wait for all ranks at the end.
  virtual void abandon() = 0;
};

/// Returns nullptr if this process was not started as one of several ranks, or the build has no
/// MPI.
std::unique_ptr<Link> make_mpi_link();

}  // namespace hotpath
