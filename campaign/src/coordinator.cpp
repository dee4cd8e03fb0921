// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <thread>
#include <unordered_set>

#include "cell_pool.hpp"
#include "roles.hpp"

namespace hotpath {

namespace {

using namespace std::chrono_literals;

/// Time to wait for a local result between two checks for messages.
constexpr auto kPoll = 500us;
constexpr auto kPollAlone = 100ms;
/// The remaining cells are handed out in shares, so that the last ones do not all go to one rank.
constexpr std::size_t kShares = 8;
constexpr std::size_t kMostAtOnce = 4096;

class Coordinator {
 public:
  Coordinator(const Campaign& campaign, const CrewOptions& options, Link* link)
      : campaign_(campaign),
        options_(options),
        link_(link),
        queue_(campaign.cells.begin(), campaign.cells.end()),
        open_(campaign.cells.begin(), campaign.cells.end()),
        ranks_(link == nullptr ? 1 : link->ranks(), Rank{.heard = options.now()}),
        pool_(options.threads, campaign.work) {}

  std::vector<std::string> run() {
    try {
      while (!open_.empty() && !campaign_.stopped()) {
        feed_own_threads();
        for (const CellResult& result : pool_.take(link_ == nullptr ? kPollAlone : kPoll)) accept(0, result);
        if (pool_.failure()) std::rethrow_exception(pool_.failure());
        listen();
      }
    } catch (...) {
      dismiss();
      throw;
    }
    dismiss();
    return notes_;
  }

 private:
  struct Rank {
    std::string host = {};
    std::chrono::steady_clock::time_point heard;
    std::set<std::uint64_t> has = {};  ///< Cells handed out to this rank that have no row yet.
    std::size_t wants = 0;
    bool lost = false, gone = false;
  };

  /// Takes at least `wanted` cells from the queue, if there are so many.
  std::vector<std::uint64_t> next_cells(std::size_t wanted) {
    const std::size_t share = queue_.size() / (kShares * ranks_.size());
    const std::size_t n = std::min(queue_.size(), std::clamp(share, wanted, std::max(wanted, kMostAtOnce)));
    const auto end = queue_.begin() + static_cast<std::ptrdiff_t>(n);
    std::vector<std::uint64_t> cells(queue_.begin(), end);
    queue_.erase(queue_.begin(), end);
    return cells;
  }

  void feed_own_threads() {
    if (queue_.empty() || pool_.waiting() >= options_.threads) return;
    const std::vector<std::uint64_t> cells = next_cells(options_.threads);
    pool_.add(cells);
  }

  void accept(unsigned from, const CellResult& result) {
    if (!result.failure.empty() && from != 0) throw CampaignError(result.failure);
    if (!result.failure.empty()) return;  // run() rethrows its exception
    ranks_[from].has.erase(result.cell);
    if (open_.erase(result.cell) == 0) return;  // another rank has computed it already
    campaign_.gather(result.cell, result.row);
  }

  void listen() {
    if (link_ == nullptr) return;
    while (const auto received = link_->receive()) handle(received->from, unpack(received->bytes));
    const auto now = options_.now();
    for (unsigned r = 1; r < ranks_.size(); ++r) {
      if (!ranks_[r].lost && now - ranks_[r].heard > options_.silence) give_up(r);
    }
    for (unsigned r = 1; r < ranks_.size() && !queue_.empty(); ++r) {
      if (ranks_[r].wants > 0 && !ranks_[r].lost) hand_out(r);
    }
  }

  void handle(unsigned from, const Message& message) {
    Rank& rank = ranks_[from];
    rank.heard = options_.now();
    if (rank.lost) {
      rank.lost = false;
      notes_.push_back(name(from) + " is back.");
    }
    rank.gone |= message.kind == Message::Kind::bye;
    if (message.kind == Message::Kind::hello) {
      rank.host = message.text;
      if (message.number != identity(campaign_)) {
        throw CampaignError(name(from) +
                            " runs another build of this program or another campaign; start all "
                            "ranks with one program and the same arguments");
      }
    }
    for (const CellResult& result : message.results) accept(from, result);
    if (message.kind != Message::Kind::report && message.kind != Message::Kind::hello) return;
    if (message.kind == Message::Kind::report && message.number > 0) rank.wants = message.number;
    hand_out(from);
  }

  /// Answers a rank; sends cells if it requested some and some remain.
  void hand_out(unsigned to) {
    Rank& rank = ranks_[to];
    Message answer{.kind = Message::Kind::cells};
    if (rank.wants > 0) answer.cells = next_cells(rank.wants);
    if (!answer.cells.empty()) rank.wants = 0;
    rank.has.insert(answer.cells.begin(), answer.cells.end());
    link_->send(to, pack(answer));
  }

  void give_up(unsigned r) {
    Rank& rank = ranks_[r];
    rank.lost = true;
    rank.wants = 0;
    std::erase_if(rank.has, [this](std::uint64_t cell) { return !open_.contains(cell); });
    notes_.push_back(name(r) + " has been silent for " + std::to_string(options_.silence.count()) +
                     " ms; other ranks compute its " + std::to_string(rank.has.size()) + " cells.");
    queue_.insert(queue_.begin(), rank.has.begin(), rank.has.end());
    rank.has.clear();
  }

  std::string name(unsigned r) const {
    return "Rank " + std::to_string(r) + (ranks_[r].host.empty() ? "" : " (" + ranks_[r].host + ")");
  }

  /// Ends the other ranks. Receives all their remaining messages, so that none stays in transit.
  void dismiss() {
    if (link_ == nullptr) return;
    const bool some_lost = std::ranges::any_of(ranks_, &Rank::lost);
    const std::string stop = pack({.kind = Message::Kind::stop, .number = some_lost});
    for (unsigned r = 1; r < ranks_.size(); ++r) {
      if (!ranks_[r].gone) link_->send(r, stop);
    }
    const auto waits_for = [](const Rank& rank) { return !rank.gone && !rank.lost; };
    const auto until = options_.now() + options_.silence;
    ranks_[0].gone = true;
    while (std::ranges::any_of(ranks_, waits_for) && options_.now() < until) {
      while (const auto received = link_->receive()) {
        ranks_[received->from].gone |= unpack(received->bytes).kind == Message::Kind::bye;
      }
      std::this_thread::sleep_for(kPoll);
    }
    if (some_lost || std::ranges::any_of(ranks_, waits_for)) link_->abandon();
  }

  const Campaign& campaign_;
  const CrewOptions& options_;
  Link* const link_;
  std::deque<std::uint64_t> queue_;
  std::unordered_set<std::uint64_t> open_;  // cells not gathered yet
  std::vector<Rank> ranks_;
  std::vector<std::string> notes_;
  CellPool pool_;
};

}  // namespace

std::vector<std::string> coordinate(const Campaign& campaign, const CrewOptions& options, Link* link) {
  return Coordinator(campaign, options, link).run();
}

}  // namespace hotpath
