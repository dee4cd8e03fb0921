// SPDX-License-Identifier: Apache-2.0
#include "hotpath/campaign/crew.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <iterator>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <thread>

#include "message.hpp"
#include "roles.hpp"

namespace hotpath {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A clock that only the test advances.
struct TestClock {
  std::atomic<int> ms = 0;
  CrewOptions options() {
    const auto now = [this] {
      return std::chrono::steady_clock::time_point(std::chrono::milliseconds(ms.load()));
    };
    return {2, kSilence, now};
  }
  static constexpr std::chrono::milliseconds kSilence{200};
};

/// Ranks simulated by threads of this process.
struct Hub {
  std::mutex mutex;
  std::map<unsigned, std::deque<Link::Received>> boxes;
};

class HubLink final : public Link {
 public:
  HubLink(Hub& hub, unsigned rank, unsigned ranks) : hub_(hub), rank_(rank), ranks_(ranks) {}
  unsigned rank() const override { return rank_; }
  unsigned ranks() const override { return ranks_; }
  unsigned ranks_on_this_machine() const override { return ranks_; }
  void abandon() override { abandoned = true; }
  void send(unsigned to, std::string bytes) override {
    const std::lock_guard lock(hub_.mutex);
    hub_.boxes[to].push_back({rank_, std::move(bytes)});
  }
  std::optional<Received> receive() override {
    const std::lock_guard lock(hub_.mutex);
    auto& box = hub_.boxes[rank_];
    if (box.empty()) return std::nullopt;
    Received first = std::move(box.front());
    box.pop_front();
    return first;
  }
  bool abandoned = false;

 private:
  Hub& hub_;
  unsigned rank_, ranks_;
};

class CrewTest : public testing::Test {
 protected:
  Campaign campaign(std::uint64_t cells) {
    Campaign c;
    c.name = "test";
    c.cells.resize(cells);
    std::iota(c.cells.begin(), c.cells.end(), 0);
    c.work = [](std::uint64_t cell) { return "row " + std::to_string(cell); };
    c.gather = [this](std::uint64_t cell, const std::string& row) {
      EXPECT_EQ(row, "row " + std::to_string(cell));
      ++gathered_[cell];
    };
    return c;
  }

  void expect_each_once(std::uint64_t cells) {
    EXPECT_EQ(gathered_.size(), cells);
    for (const auto& [cell, times] : gathered_) EXPECT_EQ(times, 1U) << cell;
  }

  TestClock clock_;
  const CrewOptions options_ = clock_.options();
  const CrewOptions real_time_{.threads = 2};
  Hub hub_;
  std::map<std::uint64_t, unsigned> gathered_;
};

TEST_F(CrewTest, OneProcessDoesEachCellOnce) {
  Crew crew({.threads = 3});
  EXPECT_TRUE(crew.coordinates());
  EXPECT_THAT(crew.run(campaign(10'000)), IsEmpty());
  expect_each_once(10'000);
}

TEST_F(CrewTest, AnEmptyCampaignEndsImmediately) {
  EXPECT_THAT(Crew({.threads = 1}).run(campaign(0)), IsEmpty());
}

TEST_F(CrewTest, RanksShareTheCells) {
  std::atomic<unsigned> by_rank_1 = 0;
  HubLink zero(hub_, 0, 3), one(hub_, 1, 3), two(hub_, 2, 3);
  const Campaign mine = campaign(5000);
  Campaign others = mine;
  others.work = [&](std::uint64_t cell) {
    ++by_rank_1;
    return mine.work(cell);
  };
  {
    std::jthread first([&] { work_for_coordinator(others, real_time_, one); });
    std::jthread second([&] { work_for_coordinator(others, real_time_, two); });
    Campaign slow = mine;  // so that the others get cells on a busy machine as well
    slow.work = [&](std::uint64_t cell) {
      while (by_rank_1 == 0) std::this_thread::yield();
      return mine.work(cell);
    };
    EXPECT_THAT(coordinate(slow, real_time_, &zero), IsEmpty());
  }
  expect_each_once(5000);
  EXPECT_GT(by_rank_1, 0U);
  EXPECT_FALSE(zero.abandoned || one.abandoned || two.abandoned);
}

TEST_F(CrewTest, OtherRanksComputeTheCellsOfADeadRankAndTheRunReportsIt) {
  HubLink zero(hub_, 0, 2), one(hub_, 1, 2);
  const Campaign c = campaign(300);
  // The rank sends hello, requests cells, and falls silent.
  one.send(0, pack({.kind = Message::Kind::hello, .number = identity(c), .text = "host"}));
  one.send(0, pack({.kind = Message::Kind::report, .number = 4}));
  Campaign slow = c;  // cells remain when its message is read
  slow.work = [&](std::uint64_t cell) {
    ++clock_.ms;
    return c.work(cell);
  };
  const std::vector<std::string> notes = coordinate(slow, options_, &zero);
  expect_each_once(300);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("Rank 1 (host) has been silent for")));
  EXPECT_THAT(notes.front(), testing::Not(HasSubstr("its 0 cells")));
  EXPECT_TRUE(zero.abandoned);
}

TEST_F(CrewTest, ARankThatComesBackIsAcceptedAndNoCellCountsTwice) {
  HubLink zero(hub_, 0, 2), one(hub_, 1, 2);
  const Campaign c = campaign(400);
  one.send(0, pack({.kind = Message::Kind::hello, .number = identity(c)}));
  one.send(0, pack({.kind = Message::Kind::report, .number = 50}));
  std::set<std::uint64_t> its;
  std::atomic<bool> has_some = false, lost = false, back = false;
  Campaign slow = c;
  slow.work = [&](std::uint64_t cell) {
    while (!has_some) std::this_thread::yield();
    if (its.contains(cell)) lost = true;  // it was handed out again
    if (!lost) clock_.ms += 10;
    while (lost && !back) std::this_thread::yield();
    return c.work(cell);
  };
  std::jthread rank([&] {
    while (its.empty()) {
      if (const auto got = one.receive())
        std::ranges::copy(unpack(got->bytes).cells, std::inserter(its, its.end()));
    }
    has_some = true;
    while (!lost) std::this_thread::yield();
    Message late{.kind = Message::Kind::report};
    for (const std::uint64_t cell : its) late.results.push_back({cell, c.work(cell), ""});
    one.send(0, pack(late));
    back = true;
    for (bool over = false; !over;) {
      while (const auto got = one.receive()) over = unpack(got->bytes).kind == Message::Kind::stop;
    }
    one.send(0, pack({.kind = Message::Kind::bye}));
  });
  const std::vector<std::string> notes = coordinate(slow, options_, &zero);
  expect_each_once(400);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("has been silent for"), HasSubstr("Rank 1 is back")));
}

TEST_F(CrewTest, ARankOfAnotherBuildIsRefused) {
  HubLink zero(hub_, 0, 2), one(hub_, 1, 2);
  Campaign never_ends = campaign(1'000'000'000 / 1000);
  never_ends.work = [](std::uint64_t) { return std::string(); };
  never_ends.gather = [](std::uint64_t, const std::string&) {};
  one.send(0, pack({.kind = Message::Kind::hello, .number = 1, .text = "host"}));
  one.send(0, pack({.kind = Message::Kind::bye}));
  EXPECT_THROW(
      try { coordinate(never_ends, options_, &zero); } catch (const CampaignError& error) {
        EXPECT_THAT(error.what(), HasSubstr("Rank 1 (host) runs another build"));
        throw;
      },
      CampaignError);
}

TEST_F(CrewTest, WithoutACoordinatorARankEnds) {
  HubLink one(hub_, 1, 2);
  hub_.boxes[1].push_back({0, pack({.kind = Message::Kind::cells, .cells = {7}})});
  EXPECT_THROW(work_for_coordinator(campaign(1), {1, std::chrono::milliseconds(20)}, one), CampaignError);
}

TEST_F(CrewTest, AnExceptionOfACellEndsTheCampaign) {
  Campaign c = campaign(100);
  c.work = [](std::uint64_t cell) -> std::string {
    if (cell == 50) throw std::invalid_argument("cell 50");
    return "row " + std::to_string(cell);
  };
  EXPECT_THROW(Crew({.threads = 2}).run(c), std::invalid_argument);
}

TEST_F(CrewTest, GatheringThatFailsEndsTheOtherRanks) {
  HubLink zero(hub_, 0, 2), one(hub_, 1, 2);
  Campaign c = campaign(100'000);
  const Campaign others = c;
  c.gather = [](std::uint64_t, const std::string&) { throw std::runtime_error("disk full"); };
  std::jthread rank([&] { work_for_coordinator(others, real_time_, one); });
  EXPECT_THROW(coordinate(c, real_time_, &zero), std::runtime_error);
}

TEST_F(CrewTest, StopsWhenAsked) {
  Campaign c = campaign(1'000'000);
  c.stopped = [this] { return gathered_.size() > 10; };
  Crew({.threads = 1}).run(c);
  EXPECT_LT(gathered_.size(), 1'000'000U);
}

TEST_F(CrewTest, MessagesArriveAsTheyWere) {
  const Message sent{Message::Kind::report, 3, "host", {1, 2}, {{5, "row", ""}, {6, "", "no"}}};
  const Message got = unpack(pack(sent));
  EXPECT_EQ(got.text, "host");
  EXPECT_THAT(got.cells, ElementsAre(1, 2));
  EXPECT_EQ(got.results.at(1).failure, "no");
  EXPECT_EQ(pack(got), pack(sent));
  EXPECT_THROW((void)unpack(pack(sent).substr(0, 20)), CampaignError);
}

}  // namespace
}  // namespace hotpath
