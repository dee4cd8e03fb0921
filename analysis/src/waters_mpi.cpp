// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/waters_mpi.hpp"

#include <mpi.h>

#include <limits>
#include <numeric>

namespace hotpath {

MpiSession::MpiSession(int* argc, char*** argv) { MPI_Init(argc, argv); }
MpiSession::~MpiSession() { MPI_Finalize(); }

std::uint32_t MpiSession::rank() const {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return static_cast<std::uint32_t>(rank);
}

std::uint32_t MpiSession::ranks() const {
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  return static_cast<std::uint32_t>(ranks);
}

std::optional<WatersResult> run_waters_mpi(const MpiSession& session, const WatersOptions& options) {
  const std::string mine = pack_waters(waters_share(options, session.rank(), session.ranks()));
  // A share too long to send travels as -1, so that every rank learns of it.
  constexpr std::size_t kMost = std::numeric_limits<int>::max();
  const int length = mine.size() > kMost ? -1 : static_cast<int>(mine.size());
  std::vector<int> lengths(session.ranks());
  MPI_Allgather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, MPI_COMM_WORLD);
  std::size_t total = 0;
  for (const int l : lengths) {
    total = l < 0 ? kMost + 1 : total + static_cast<std::size_t>(l);
    if (total > kMost) throw AnalysisError("the shares together exceed 2 GiB; run fewer task sets at a time");
  }
  std::vector<int> offsets(lengths.size(), 0);
  std::exclusive_scan(lengths.begin(), lengths.end(), offsets.begin(), 0);
  std::string all(session.rank() == 0 ? total : 0, '\0');
  MPI_Gatherv(mine.data(), length, MPI_CHAR, all.data(), lengths.data(), offsets.data(), MPI_CHAR, 0,
              MPI_COMM_WORLD);
  if (session.rank() != 0) return std::nullopt;
  std::vector<WatersResult> shares;
  for (std::size_t r = 0; r < lengths.size(); ++r) {
    shares.push_back(unpack_waters(
        all.substr(static_cast<std::size_t>(offsets[r]), static_cast<std::size_t>(lengths[r]))));
  }
  return join_waters(shares);
}

}  // namespace hotpath
