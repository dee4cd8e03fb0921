// SPDX-License-Identifier: Apache-2.0
#include "results/run_folder.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <set>

#include "graph_fixture.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"
#include "results/run_record.hpp"

namespace hotpath::run_folder_test {

namespace fs = std::filesystem;
using ::testing::UnorderedElementsAre;

class RunFolderTest : public ::testing::Test {
 protected:
  RunFolderTest() {
    set_.tasks.emplace_back();
    set_.tasks[0].name = "Lidar";
    set_.tasks[0].period = std::chrono::milliseconds(10);
  }

  static std::set<std::string> files(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
  }
  Trace trace(std::uint32_t repetition) const {
    Trace t;
    t.executor = "rm-ro";
    t.repetition = repetition;
    t.epoch = from_ns(1'000'000);
    const Time start = t.epoch + Duration(5);
    t.jobs.push_back({{0, 0, start, start, kNever, {}}, start, t.epoch + Duration(7)});
    return t;
  }

  const Folder folder_;
  const fs::path base_ = folder_.path();
  TaskSet set_;
};

TEST_F(RunFolderTest, FilesGetTheirNamesWhenTheyAreWhole) {
  results::RunFolder folder(base_ / "deep" / "run");
  EXPECT_THAT(files(folder.path()), UnorderedElementsAre("jobs.csv.part", "chains.csv.part"));
  folder.write("run.json", nlohmann::json{{"complete", false}});
  folder.append(set_, {"hot_path"}, trace(0));
  EXPECT_THAT(files(folder.path()), UnorderedElementsAre("jobs.csv.part", "chains.csv.part", "run.json"));
  folder.finish();
  EXPECT_THAT(files(folder.path()), UnorderedElementsAre("jobs.csv", "chains.csv", "run.json"));
}

TEST_F(RunFolderTest, RowsOfEveryRepetitionStandUnderOneHeader) {
  results::RunFolder folder(base_ / "run");
  Trace second = trace(1);
  second.chains = {{0, 3, 0, Duration(40), Duration(50)}};
  folder.append(set_, {"hot_path"}, trace(0));
  folder.append(set_, {"hot_path"}, second);
  folder.finish();
  EXPECT_EQ(read_text_file(base_ / "run" / "jobs.csv"), std::string(kJobsCsvHeader) +
                                                            "\nrm-ro,0,Lidar,timer,0,ran,5,5,5,7,,,0,,0,,\n"
                                                            "rm-ro,1,Lidar,timer,0,ran,5,5,5,7,,,0,,0,,\n");
  EXPECT_EQ(read_text_file(base_ / "run" / "chains.csv"),
            std::string(kChainsCsvHeader) + "\nrm-ro,1,hot_path,3,40,50,,,\n");
}

TEST_F(RunFolderTest, ARunThatWasInterruptedOrFailedIsNotComplete) {
  results::RunRecord whole, partial, failed;
  partial.partial = true;
  failed.failures = {"rm-ro was killed."};
  for (results::RunRecord* record : {&whole, &partial, &failed}) {
    record->simulation.emplace();
    results::RunFolder folder(base_ / std::to_string(record - &whole));
    folder.close(*record, nlohmann::json::object());
    const auto stored = nlohmann::json::parse(read_text_file(folder.path() / "run.json"));
    EXPECT_EQ(record->complete, record == &whole);
    EXPECT_EQ(stored["complete"], record == &whole);
  }
}

TEST_F(RunFolderTest, ARunningRunIsLocked) {
  {
    const results::RunFolder folder(base_ / "run");
    EXPECT_LT(results::RunFolder::lock(base_ / "run"), 0);
  }
  const int lock = results::RunFolder::lock(base_ / "run");
  EXPECT_GE(lock, 0) << "it was killed";
  close(lock);
}

/// Emulates a full disk: a limit prevents files from growing.
class RunFolderOnAFullDisk : public RunFolderTest {
 protected:
  RunFolderOnAFullDisk() {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
  }
  ~RunFolderOnAFullDisk() override { setrlimit(RLIMIT_FSIZE, &before_); }
  void fill() const {
    const rlimit limit{200, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  rlimit before_{};
};

TEST_F(RunFolderOnAFullDisk, ARunWhoseRecordCannotBeWrittenIsNotComplete) {
  results::RunFolder folder(base_ / "run");
  results::RunRecord record;
  fill();
  EXPECT_THROW(folder.close(record, nlohmann::json::object()), program::RunError);
  EXPECT_FALSE(record.complete);
  EXPECT_THAT(files(base_ / "run"), UnorderedElementsAre("jobs.csv", "chains.csv", "summary.json"));
}

}  // namespace hotpath::run_folder_test
