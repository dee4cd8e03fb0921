// SPDX-License-Identifier: Apache-2.0
#include "hotpath/campaign/crew.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <fstream>
#include <list>
#include <mutex>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#ifdef HOTPATH_WITH_MPI
#include <mpi.h>
#endif

namespace hotpath {

#ifdef HOTPATH_WITH_MPI
/// Messages between the ranks of this MPI job, for one thread.
struct Crew::Messages {
  /// Sets rank and ranks of the crew.
  explicit Messages(Crew& crew) {
    // Only under a launcher, because starting MPI costs more than a short campaign.
    for (const char* of_launcher : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
      started_ = started_ || std::getenv(of_launcher) != nullptr;
    if (!started_) return;
    int number = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &number);
    MPI_Comm_rank(MPI_COMM_WORLD, &number);
    crew.rank_ = static_cast<unsigned>(number);
    MPI_Comm_size(MPI_COMM_WORLD, &number);
    crew.threads_of_.resize(static_cast<std::size_t>(number));
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    MPI_Comm_size(machine, &number);
    crew.ranks_on_this_machine_ = static_cast<unsigned>(number);
    MPI_Comm_free(&machine);
  }

  /// Does not block, even if the receiver is stopped. Messages to one rank arrive in order.
  void send(std::size_t to, std::string bytes) {
    auto& [content, request] = outgoing_.emplace_back(std::move(bytes), MPI_REQUEST_NULL);
    MPI_Isend(content.data(), static_cast<int>(content.size()), MPI_CHAR, static_cast<int>(to), 0,
              MPI_COMM_WORLD, &request);
  }

  /// Sender and content of the next message; std::nullopt if none is there.
  std::optional<std::pair<std::size_t, std::string>> receive() {
    if (!started_) return std::nullopt;
    std::erase_if(outgoing_, [](auto& message) {
      int sent = 0;
      MPI_Test(&message.second, &sent, MPI_STATUS_IGNORE);
      return sent != 0;
    });
    int there = 0, bytes = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &there, &status);
    if (there == 0) return std::nullopt;
    MPI_Get_count(&status, MPI_CHAR, &bytes);
    std::string content(static_cast<std::size_t>(bytes), '\0');
    MPI_Recv(content.data(), bytes, MPI_CHAR, status.MPI_SOURCE, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return std::pair(static_cast<std::size_t>(status.MPI_SOURCE), std::move(content));
  }

  /// Waits until all ranks leave. If the campaign is not complete, all ranks end when this process
  /// exits, with its exit code: it has yet to say what went wrong.
  void leave(bool complete) {
    if (!complete) on_exit([](int code, void*) { MPI_Abort(MPI_COMM_WORLD, code); }, nullptr);
    if (!complete || !started_) return;
    for (auto& [content, request] : outgoing_) MPI_Wait(&request, MPI_STATUS_IGNORE);
    MPI_Finalize();
  }

 private:
  std::list<std::pair<std::string, MPI_Request>> outgoing_;  // possibly not taken by its receiver yet
  bool started_ = false;
};
#else
/// This process is the only rank.
struct Crew::Messages {
  explicit Messages(Crew&) {}
  void send(std::size_t, const std::string&) {}
  std::optional<std::pair<std::size_t, std::string>> receive() { return std::nullopt; }
  void leave(bool) {}
};
#endif

namespace {

/// Longest time between two looks for messages, or for a stop.
constexpr std::chrono::milliseconds kLook{10};
/// The remaining cells are handed out in shares, so that the last ones do not all go to one rank.
constexpr std::size_t kShares = 8, kMostAtOnce = 4096;

using Row = std::pair<std::uint64_t, std::string>;  // a cell and what its work gave

/// Threads that compute the cells of a queue. The destructor waits for the cells that have begun.
class CellPool {
 public:
  CellPool(unsigned threads, const Campaign& campaign) : work_(campaign.work) {
    while (threads_.size() < threads) {
      threads_.emplace_back([this](const std::stop_token& stop) { work_until(stop); });
    }
  }

  void add(std::span<const std::uint64_t> cells) {
    const std::lock_guard lock(mutex_);
    queue_.insert(queue_.end(), cells.begin(), cells.end());
    added_.notify_all();
  }

  /// Takes all available rows; if there are none, rethrows the exception of the first failed cell, or
  /// waits for the first row, at most `most`.
  std::vector<Row> take(std::chrono::milliseconds most) {
    std::unique_lock lock(mutex_);
    done_.wait_for(lock, most, [this] { return !rows_.empty() || failure_; });
    if (failure_ && rows_.empty()) std::rethrow_exception(failure_);
    return std::exchange(rows_, {});
  }

 private:
  void work_until(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (added_.wait(lock, stop, [this] { return !queue_.empty(); }) && !stop.stop_requested()) {
      Row row(queue_.front(), {});
      queue_.pop_front();
      lock.unlock();
      std::exception_ptr failure;
      try {
        row.second = work_(row.first);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      if (!failure) rows_.push_back(std::move(row));
      if (!failure_) failure_ = failure;
      done_.notify_one();
    }
  }

  const std::function<std::string(std::uint64_t)>& work_;
  std::mutex mutex_;
  std::condition_variable_any added_, done_;
  std::deque<std::uint64_t> queue_;
  std::vector<Row> rows_;
  std::exception_ptr failure_;
  std::vector<std::jthread> threads_;  // last: the threads use all other members
};

// Messages are in this machine's byte order: all ranks run one build. The coordinator sends the
// numbers of cells, or nothing: the campaign is complete. Another rank sends `identity` and its
// threads, and then each row, after the number of its cell.
std::string bytes_of(std::span<const std::uint64_t> numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()};
}

std::vector<std::uint64_t> numbers_of(std::string_view bytes) {
  std::vector<std::uint64_t> numbers(bytes.size() / sizeof(std::uint64_t));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof numbers[0]);
  return numbers;
}

std::uint64_t identity(const Campaign& campaign) { return hash_of(campaign.name, build_fingerprint()); }

}  // namespace

Crew::Crew(unsigned threads)
    : threads_(threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency())), threads_of_(1) {
  messages_ = std::make_unique<Messages>(*this);
  threads_of_[0] = threads_;
}

Crew::~Crew() {
  // A rank may have reported too late for a cell.
  while (complete_ && coordinates() && std::ranges::count(threads_of_, 0U) > 0) {
    if (const auto report = messages_->receive()) threads_of_[report->first] = 1;
  }
  messages_->leave(complete_ || ranks() == 1);
}

void Crew::run(const Campaign& campaign) {
  if (!coordinates()) return work_for_coordinator(campaign);
  CellPool pool(threads_, campaign);
  std::span<const std::uint64_t> left = campaign.cells;
  std::size_t missing = left.size();
  std::vector<std::size_t> has(ranks());  // cells that each rank has and whose rows are missing
  const auto gather = [&](std::size_t from, std::uint64_t cell, const std::string& row) {
    --has[from];
    --missing;
    campaign.gather(cell, row);
  };
  while (missing > 0 && !campaign.stopped()) {
    for (std::size_t rank = 0; rank < has.size(); ++rank) {
      const std::size_t least = 2 * threads_of_[rank];  // so that a thread need not wait for its next cell
      if (left.empty() || has[rank] >= least) continue;
      const std::size_t share = std::min(left.size() / (kShares * ranks()), kMostAtOnce);
      const auto cells = left.first(std::min(left.size(), std::max(share, least - has[rank])));
      left = left.subspan(cells.size());
      has[rank] += cells.size();
      if (rank == 0) pool.add(cells);
      if (rank > 0) messages_->send(rank, bytes_of(cells));
    }
    for (const auto& [cell, row] : pool.take(kLook)) gather(0, cell, row);
    while (const auto message = messages_->receive()) {
      const auto& [from, bytes] = *message;
      const std::vector<std::uint64_t> numbers = numbers_of(bytes);
      if (threads_of_[from] > 0) {
        gather(from, numbers[0], bytes.substr(sizeof numbers[0]));
      } else if (numbers.size() == 2 && numbers[0] == identity(campaign)) {
        threads_of_[from] = numbers[1];
      } else {
        throw std::runtime_error("rank " + std::to_string(from) +
                                 " runs another build of this program or another campaign; start all ranks "
                                 "with one program and the same arguments");
      }
    }
  }
  complete_ = missing == 0;
  for (std::size_t rank = 1; complete_ && rank < ranks(); ++rank) messages_->send(rank, "");
}

void Crew::work_for_coordinator(const Campaign& campaign) {
  CellPool pool(threads_, campaign);
  messages_->send(0, bytes_of(std::array<std::uint64_t, 2>{identity(campaign), threads_}));
  while (!complete_ && !campaign.stopped()) {
    for (const auto& [cell, row] : pool.take(kLook)) messages_->send(0, bytes_of({&cell, 1}) + row);
    while (const auto message = messages_->receive()) {
      pool.add(numbers_of(message->second));
      complete_ = message->second.empty();
    }
  }
}

std::uint64_t hash_of(std::string_view bytes, std::uint64_t so_far) {
  for (const char byte : bytes) so_far = (so_far ^ static_cast<unsigned char>(byte)) * 0x100000001b3;
  return so_far;
}

std::uint64_t build_fingerprint() {
  static const std::uint64_t fingerprint =
      hash_of((std::ostringstream() << std::ifstream("/proc/self/exe", std::ios::binary).rdbuf()).view());
  return fingerprint;
}

}  // namespace hotpath
