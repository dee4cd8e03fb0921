// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <array>
#include <iterator>
#include <utility>

#include "cell_pool.hpp"
#include "roles.hpp"

namespace hotpath {

namespace {

using namespace std::chrono_literals;

constexpr auto kLook = 1ms;
/// Results within this interval are sent together.
constexpr auto kTogether = 50ms;
/// A coordinator counts as gone after this multiple of the silence that makes a rank lost.
constexpr int kPatience = 4;

class Worker {
 public:
  Worker(const Campaign& campaign, const CrewOptions& options, Link& link)
      : options_(options), link_(link), pool_(options.threads, campaign.work) {
    std::array<char, 256> host{};
    gethostname(host.data(), host.size() - 1);
    send({.kind = Message::Kind::hello, .number = identity(campaign), .text = host.data()});
  }

  void run() {
    while (!listen()) {
      std::vector<CellResult> done = pool_.take(kLook);
      std::ranges::move(done, std::back_inserter(results_));
      const auto now = options_.now();
      const bool hungry = answered_ && !asked_ && pool_.waiting() < options_.threads;
      const bool due = now - sent_ > (results_.empty() ? options_.silence / 4 : kTogether);
      if (hungry || due) {
        asked_ = asked_ || hungry;
        send({.kind = Message::Kind::report,
              .number = hungry ? 2 * options_.threads : 0,
              .results = std::exchange(results_, {})});
      }
      // Before its first answer the coordinator may be busy preparing.
      if (answered_ && now - heard_ > kPatience * options_.silence) {
        link_.abandon();
        throw CampaignError("rank " + std::to_string(link_.rank()) +
                            ": the coordinating rank no longer answers; the rows that it gathered are kept");
      }
    }
  }

 private:
  void send(const Message& message) {
    link_.send(0, pack(message));
    sent_ = options_.now();
  }

  /// Handles incoming messages; returns whether the campaign is over.
  bool listen() {
    while (const auto received = link_.receive()) {
      const Message message = unpack(received->bytes);
      heard_ = options_.now();
      answered_ = true;
      if (message.kind == Message::Kind::stop) {
        send({.kind = Message::Kind::bye});
        if (message.number != 0) link_.abandon();
        return true;
      }
      pool_.add(message.cells);
      asked_ = asked_ && message.cells.empty();
    }
    return false;
  }

  const CrewOptions& options_;
  Link& link_;
  std::vector<CellResult> results_;
  bool answered_ = false, asked_ = false;
  std::chrono::steady_clock::time_point sent_, heard_ = options_.now();
  CellPool pool_;
};

}  // namespace

void work_for_coordinator(const Campaign& campaign, const CrewOptions& options, Link& link) {
  Worker(campaign, options, link).run();
}

}  // namespace hotpath
