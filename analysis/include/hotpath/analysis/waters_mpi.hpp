// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hotpath/analysis/waters_experiment.hpp"

namespace hotpath {

/// An MPI environment for the life of this object; only where the build found MPI (target waters_mpi). One at
/// a time.
class MpiSession {
 public:
  MpiSession(int* argc, char*** argv);
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;

  std::uint32_t rank() const;
  std::uint32_t ranks() const;
};

/// Each rank computes its share; rank 0 gathers and gets the whole result, the others none. All ranks call it
/// with equal options.
std::optional<WatersResult> run_waters_mpi(const MpiSession& session, const WatersOptions& options);

}  // namespace hotpath
