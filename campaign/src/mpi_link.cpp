// SPDX-License-Identifier: Apache-2.0
#include <mpi.h>

#include <chrono>
#include <cstdlib>
#include <limits>
#include <list>
#include <thread>

#include "hotpath/campaign/campaign.hpp"
#include "link.hpp"

namespace hotpath {

namespace {

using namespace std::chrono_literals;

/// Time limit for outgoing messages if not all ranks end together.
constexpr auto kFarewell = 2s;

class MpiLink final : public Link {
 public:
  MpiLink() {
    // Other threads only compute; the thread that created the link communicates.
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks_);
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &on_this_machine_);
    MPI_Comm_free(&machine);
  }

  ~MpiLink() override {
    if (!abandoned_) {
      MPI_Finalize();
      return;
    }
    // MPI_Finalize would wait for all ranks.
    const auto until = std::chrono::steady_clock::now() + kFarewell;
    for (reap(); !outgoing_.empty() && std::chrono::steady_clock::now() < until; reap()) {
      std::this_thread::sleep_for(1ms);
    }
  }

  unsigned rank() const override { return static_cast<unsigned>(rank_); }
  unsigned ranks() const override { return static_cast<unsigned>(ranks_); }
  unsigned ranks_on_this_machine() const override { return static_cast<unsigned>(on_this_machine_); }
  void abandon() override { abandoned_ = true; }

  void send(unsigned to, std::string bytes) override {
    if (bytes.size() > std::numeric_limits<int>::max()) throw CampaignError("a row exceeds 2 GiB");
    Outgoing& message = outgoing_.emplace_back(std::move(bytes), MPI_REQUEST_NULL);
    MPI_Isend(message.bytes.data(), static_cast<int>(message.bytes.size()), MPI_CHAR, static_cast<int>(to), 0,
              MPI_COMM_WORLD, &message.request);
    reap();
  }

  std::optional<Received> receive() override {
    reap();
    int there = 0, size = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &there, &status);
    if (there == 0) return std::nullopt;
    MPI_Get_count(&status, MPI_CHAR, &size);
    Received received{static_cast<unsigned>(status.MPI_SOURCE),
                      std::string(static_cast<std::size_t>(size), '\0')};
    MPI_Recv(received.bytes.data(), size, MPI_CHAR, status.MPI_SOURCE, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return received;
  }

 private:
  struct Outgoing {
    Outgoing(std::string b, MPI_Request r) : bytes(std::move(b)), request(r) {}
    std::string bytes;
    MPI_Request request;
  };

  /// Removes sent messages.
  void reap() {
    std::erase_if(outgoing_, [](Outgoing& message) {
      int left = 0;
      MPI_Test(&message.request, &left, MPI_STATUS_IGNORE);
      return left != 0;
    });
  }

  std::list<Outgoing> outgoing_;
  int rank_ = 0, ranks_ = 1, on_this_machine_ = 1;
  bool abandoned_ = false;
};

}  // namespace

std::unique_ptr<Link> make_mpi_link() {
  // Only under a launcher, because starting MPI costs more than a short campaign.
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"}) {
    if (std::getenv(variable) != nullptr) return std::make_unique<MpiLink>();
  }
  return nullptr;
}

}  // namespace hotpath
