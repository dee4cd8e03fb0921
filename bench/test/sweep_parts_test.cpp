// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <random>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"
#include "program/hash.hpp"
#include "program/text.hpp"
#include "sweep/capacity.hpp"
#include "sweep/design.hpp"
#include "sweep/journal.hpp"
#include "sweep/rows.hpp"

namespace hotpath::sweep_parts_test {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class SweepTest : public testing::Test {
 protected:
  sweep::Design design(const std::string& text) {
    std::ofstream(folder_ / "sweep.yaml") << text;
    return sweep::load_sweep(folder_ / "sweep.yaml");
  }
  void expect_refusal(const std::string& text, const std::string& said) {
    EXPECT_THAT([&] { (void)design(text); }, testing::ThrowsMessage<InputError>(HasSubstr(said))) << text;
  }
  static std::string values(const sweep::Design& d, std::uint64_t cell) {
    std::string all;
    for (const sweep::Option& option : d.coordinates(cell)) all += option.name + "=" + option.value + " ";
    return all;
  }

  const Folder removed_;
  const fs::path folder_ = removed_.path();
};

constexpr const char* kGrid =
    "command: simulate\n"
    "fixed: {graph: autoware, deployments: [a, b]}\n"
    "axes:\n"
    "  load: {from: 20, to: 20.5, step: 0.1}\n"
    "  phases: [creation, random]\n"
    "repetitions: 3\n";

TEST_F(SweepTest, AGridHasEachPointAndRepetitionOnceTheLastAxisFastest) {
  const sweep::Design d = design(kGrid);
  EXPECT_EQ(d.cells(), 6U * 2 * 3);
  for (const auto& [cell, at] : std::map<std::uint64_t, std::string>{
           {0, "load=20 phases=creation "}, {3, "load=20 phases=random "}, {35, "load=20.5 phases=random "}})
    EXPECT_EQ(values(d, cell), at);
  EXPECT_EQ(d.repetition(35), 2U);
  EXPECT_EQ(d.fixed.back().value, "a,b");
  const sweep::Design large =
      design("command: simulate\naxes: {load: {from: 0, to: 90, step: 1e-4}}\nkeep: all\n");
  EXPECT_TRUE(large.keep);
  EXPECT_EQ(large.cells(), 900'001U);
  EXPECT_EQ(values(large, 899'999), "load=89.9999 ");
}

TEST_F(SweepTest, SeedsFollowFromCoordinatesWithoutTheExecutor) {
  const auto of = [&](const std::string& axes) { return design("command: simulate\naxes: " + axes + "\n"); };
  const std::string axes = "{load: [20, 30], rate: [90], executors: [default, rm-ro]}";
  const sweep::Design d = of(axes);
  EXPECT_EQ(d.seed_of(0), d.seed_of(1));  // another executor
  EXPECT_NE(d.seed_of(0), d.seed_of(2));  // another load
  const sweep::Design swapped = of("{rate: [90], executors: [default, rm-ro], load: [20, 30]}");
  EXPECT_EQ(d.seed_of(2), swapped.seed_of(1));  // whatever the order of axes
  const sweep::Design larger = of("{load: [10, 20, 30], rate: [90], executors: [rm-ro]}");
  EXPECT_EQ(d.seed_of(0), larger.seed_of(1));  // and whatever else is swept
  EXPECT_NE(of(axes + "\nseed: 2").seed_of(0), d.seed_of(0));
}

TEST_F(SweepTest, WhatIsWrongWithAFileIsSaidWithItsLine) {
  const std::vector<std::pair<const char*, const char*>> cases = {
      {"fixd: {}\naxes: {load: [1]}", "sweep.yaml:2"},
      {"fixed: {load: 1}\naxes:\n  load: [1]",
       "sweep.yaml:4: axis load contradicts the fixed load in line 2"},
      {"axes:\n  executors: [rm-ro]\n  deployments: [cie]",
       "sweep.yaml:4: axis deployments contradicts axis executors"},
      {"axes: {load: [1, 1]}", "has 1 twice"},
      {"axes: {load: {from: 1, to: 2}}", "`step` is missing in axis load"},
      {"axes: {load: {from: 1, to: 2, step: 0}}", "too small for a grid"},
      {"axes: {load: {from: 1, to: 2, step: 1e-12}}", "too small for a grid"},  // values that read the same
      {"axes: {output: [a]}", "sets itself"},
      {"axes: {seed: [1]}", "follows from the sweep"},
      {"axes: {load: {from: 1, to: 9e5, step: 1}, rate: {from: 1, to: 9e5, step: 1}}",
       "the limit is 1 million"},
      {"axes: {load: [1, 2]}\nkeep: some", "give one of: none, all"}};
  for (const auto& [text, said] : cases)
    expect_refusal(program::concat("command: simulate\n", text, "\n"), said);
  expect_refusal("command: fly\naxes: {load: [1]}\n", "simulate");
}

/// Adds the missing cells; returns the table and the number of missing cells.
std::pair<std::string, std::size_t> finished(sweep::Journal& journal) {
  const std::vector<std::uint64_t> missing = journal.missing();
  for (const std::uint64_t cell : missing)
    journal.add(cell, program::concat("[[\"rows of ", cell * cell, "\"]]"));
  journal.flush();
  journal.write_table({"header"});
  return {read_text_file(journal.folder() / "table.csv"), missing.size()};
}

/// A damaged copy: up to 12 bytes overwritten, inserted or removed at a random place.
std::string damaged(std::string text, std::mt19937_64& random) {
  const std::size_t at = random() % text.size(),
                    n = std::min<std::size_t>(1 + random() % 12, text.size() - at);
  const std::string bytes = "\n\n0123456789 \"[],of" + std::string(2, '\0') + static_cast<char>(random());
  std::string other(n, ' ');
  for (char& c : other) c = bytes[random() % bytes.size()];
  const std::size_t kind = random() % 6;
  return kind == 0 ? text.insert(at, other) : kind == 1 ? text.erase(at, n) : text.replace(at, n, other);
}

TEST_F(SweepTest, NoDamageOfAJournalReachesTheTable) {
  const sweep::Design d = design(kGrid);
  const fs::path folder = folder_ / "out", file = folder / "cells.journal";
  const std::string table = [&] {
    sweep::Journal journal(folder, d);
    return finished(journal).first;
  }();
  const std::string whole = read_text_file(file);
  std::size_t in_the_middle = 0, at_the_end = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    const std::string text = damaged(whole, random);
    std::ofstream(file, std::ios::binary) << text;
    sweep::Journal journal(folder, d);
    const std::size_t notes = journal.notes().size();
    const auto [again, missing] = finished(journal);
    ASSERT_EQ(again, table) << "seed " << seed;
    ASSERT_LE(missing, 13U) << "intact lines are kept, seed " << seed;
    ASSERT_TRUE(missing == 0 || notes > 0) << "seed " << seed;
    for (const std::string& note : journal.notes()) {
      ++(note.find("run again") != std::string::npos && note.find("were removed") != std::string::npos
             ? at_the_end
             : in_the_middle);
    }
  }
  EXPECT_GT(in_the_middle, 200U);
  EXPECT_GT(at_the_end, 3U);
}

TEST_F(SweepTest, AJournalOfAnotherSweepOrFolderIsRefused) {
  const sweep::Design d = design(kGrid);
  sweep::Design other = d;
  other.text += "seed: 3\n";
  const fs::path folder = folder_ / "out";
  const auto refusal = [](const fs::path& of, const sweep::Design& sweep) -> std::string {
    try {
      sweep::Journal(of, sweep);
    } catch (const program::UsageError& error) {
      return error.what();
    }
    return "";
  };
  {
    const sweep::Journal first(folder, d);
    EXPECT_THAT(refusal(folder, d), HasSubstr("another process runs the sweep"));
    // Also before the first sweep has written its description.
    fs::remove(folder / "sweep.json");
    EXPECT_THAT(refusal(folder, other), HasSubstr("another process runs the sweep"));
    EXPECT_EQ(read_text_file(folder / "sweep.yaml"), d.text);
  }
  EXPECT_EQ(refusal(folder, other), "") << "the first sweep never began";
  EXPECT_EQ(read_text_file(folder / "sweep.yaml"), other.text);
  EXPECT_THAT(refusal(folder, d), HasSubstr("holds results of another sweep"));
  EXPECT_THAT(refusal("/dev/full", d), HasSubstr("Not a directory"));
  fs::create_directories(folder_ / "full" / "of");
  EXPECT_THAT(refusal(folder_ / "full", d), HasSubstr("holds other files"));
  std::ofstream(folder / "sweep.json") << R"({"version": "0.1.0", "build": 1})";
  EXPECT_THAT(refusal(folder, other), HasSubstr("begun by another build"));
  std::ofstream(folder / "sweep.json") << "{";
  EXPECT_THAT(refusal(folder, other), HasSubstr("is damaged"));
  std::ofstream(folder / "cells.journal") << "something";
  fs::remove(folder / "sweep.json");
  EXPECT_THAT(refusal(folder, other), HasSubstr("without its sweep.json"));
}

TEST_F(SweepTest, AFullDiskKeepsWhatThereIs) {
  const sweep::Design d = design(kGrid);
  { const sweep::Journal begun(folder_ / "out", d); }
  fs::remove(folder_ / "out" / "cells.journal");
  fs::create_symlink("/dev/full", folder_ / "out" / "cells.journal");
  sweep::Journal full(folder_ / "out", d);
  EXPECT_THAT(
      [&] {
        full.add(1, "one\n");
        full.flush();
      },
      testing::ThrowsMessage<program::RunError>(HasSubstr("0 cells are stored")));
}

TEST(CapacityTest, FindsTheLastLevelBelowTheFirstFailure) {
  const auto found = [](const sweep::Levels& levels, std::size_t coarse, double from, double to) {
    return sweep::find_capacity(
        levels, coarse, [=](double l) { return l > from && l < to ? std::optional("no") : std::nullopt; });
  };
  const sweep::Capacity c = found({0, 100, 0.5}, 6, 73.2, 1000);
  EXPECT_EQ(c.highest, 146U);
  EXPECT_THAT(c.again(), IsEmpty());
  EXPECT_LT(c.tried.size(), 15U);
  const sweep::Capacity holds_again = found({0, 100, 1}, 11, 35, 65);
  EXPECT_EQ(holds_again.highest, 35U);
  EXPECT_THAT(holds_again.again(), ElementsAre(70U, 80U, 90U, 100U));
  EXPECT_EQ(found({5, 9, 1}, 3, 0, 1000).highest, std::nullopt);
  EXPECT_EQ(found({5, 9, 1}, 3, 1000, 1000).highest, 4U);
  EXPECT_EQ(found({5, 5, 1}, 3, 1000, 1000).highest, 0U);
  EXPECT_EQ(found({0.1, 0.7, 0.1}, 3, 1000, 1000).highest, 6U);
}

TEST(Rows, HaveTheLargestResponseInDeadlines) {
  results::ExecutorSummary executor;
  results::TaskSummary& timer = executor.tasks.emplace_back();
  timer.period = std::chrono::milliseconds(100);
  timer.deadline = std::chrono::milliseconds(40);
  timer.response_ms = quantiles({10, 30});
  EXPECT_EQ(sweep::response_share_max(executor), 0.75);
}

TEST(CapacityTest, EveryRepetitionMeetsEveryRequirement) {
  using Each = results::RepetitionMeasures;
  results::ExecutorSummary good;
  good.chains.resize(2);
  good.chains[1].chain = "c";
  good.each = {{{}, 0, 0, 0, {{5, 20, 40}, {5, 30, 50}}}, {{}, 1, 0, 0, {{5, 20, 40}, {5, 30, 50}}}};
  const std::vector<std::pair<void (*)(Each&), std::optional<std::string>>> cases = {
      {[](Each&) {}, std::nullopt},
      {[](Each& r) { r.skipped = 1; }, "0 timestamps skipped, 0 samples overwritten (1 of 2 repetitions)"},
      {[](Each& r) { r.overwritten = 1; },
       "0 timestamps skipped, 0 samples overwritten (1 of 2 repetitions)"},
      {[](Each& r) { r.deadline_overruns = 1; }, "0 deadlines missed (1 of 2 repetitions)"},
      {[](Each& r) { r.never_ran = 1; }, "a task never ran (1 of 2 repetitions)"},
      {[](Each& r) { r.chains[1] = {}; }, "no output of chain c (1 of 2 repetitions)"},
      {[](Each& r) { r.chains[1].worst_age_ms = 90; }, "age 90.0 ms (1 of 2 repetitions)"},
      {[](Each& r) { r.chains[1].worst_hot_path_ms = 70; }, "latency 70.0 ms (1 of 2 repetitions)"}};
  for (const auto& [change, why] : cases) {
    results::ExecutorSummary executor = good;
    change(executor.each[1]);
    EXPECT_EQ(sweep::Requirement::parse({"no-loss", "deadlines", "age:80", "latency:60"}).failure(executor),
              why);
  }
  EXPECT_EQ(sweep::Requirement::parse({"no-loss"}).failure({}), "nothing was measured");
  for (const char* wrong : {"fast", "age", "age:", "latency:", "latency:-1", "latency:1s"}) {
    EXPECT_THROW((void)sweep::Requirement::parse({wrong}), program::UsageError) << wrong;
  }
}

TEST(Hash, IsFnv1a) {
  EXPECT_EQ(program::hash_of(""), 0xcbf29ce484222325U);
  EXPECT_EQ(program::hash_of("foobar"), 0x85944171f73967e8U);
}

}  // namespace hotpath::sweep_parts_test
