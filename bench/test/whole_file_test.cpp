// SPDX-License-Identifier: Apache-2.0
// Files that get their final names only when they are complete.
#include "program/whole_file.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "graph_fixture.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "program/errors.hpp"

namespace hotpath::whole_file_test {

namespace fs = std::filesystem;

/// The number of unfinished files in the test folder.
std::ptrdiff_t parts() {
  return std::count_if(fs::directory_iterator(testing::TempDir()), fs::directory_iterator(),
                       [](const auto& entry) {
                         return entry.path().filename().string().starts_with(".whole_file") &&
                                entry.path().extension() == ".part";
                       });
}

TEST(WholeFile, HoldsTextJsonOrWhatAFunctionWrites) {
  const fs::path file = fs::path(testing::TempDir()) / "whole_file.txt";
  program::write_whole_file(file, std::string("text"));
  EXPECT_EQ(read_text_file(file), "text");
  program::write_whole_file(file, nlohmann::json{{"a", 1}});
  EXPECT_EQ(read_text_file(file), "{\n  \"a\": 1\n}\n");
  program::write_whole_file(file, [](std::ostream& out) { out << 7; });
  EXPECT_EQ(read_text_file(file), "7");
  EXPECT_EQ(parts(), 0);
}

TEST(WholeFile, NamesTheOptionThatAskedForAFileThatCannotBeWritten) {
  const fs::path file = fs::path(testing::TempDir()) / "nowhere" / "file";
  EXPECT_THROW(program::write_whole_file(file, std::string("text")), program::RunError);
  EXPECT_THAT([&] { program::write_whole_file(file, "--output", std::string("text")); },
              testing::ThrowsMessage<program::UsageError>(testing::StartsWith("--output: " + file.string())));
}

TEST(WholeFile, IsNotWrittenThroughALink) {
  const Folder removed;
  const fs::path base = removed.path();
  program::write_whole_file(base / "precious", std::string("years of work"));
  fs::create_symlink("precious", base / "summary.json");
  program::write_whole_file(base / "summary.json", std::string("new"));
  EXPECT_FALSE(fs::is_symlink(base / "summary.json")) << "nobody named it: it is replaced";
  EXPECT_EQ(read_text_file(base / "precious"), "years of work");
  fs::create_symlink("precious", base / "named");
  program::write_output_file(base / "named", "--output", std::string("new"));
  EXPECT_TRUE(fs::is_symlink(base / "named")) << "the user named it: it is followed";
  EXPECT_EQ(read_text_file(base / "precious"), "new");
  EXPECT_LT(program::create_file(base / "named"), 0);
}

TEST(WholeFile, LeavesTheOldFileWhenTheNewOneIsNotWhole) {
  const fs::path file = fs::path(testing::TempDir()) / "whole_file_kept.txt";
  program::write_whole_file(file, std::string("old"));
  const auto throws = [](std::ostream&) { throw std::runtime_error("no more"); };
  EXPECT_THROW(program::write_whole_file(file, throws), std::runtime_error);
  EXPECT_THROW(program::write_whole_file(file, [](std::ostream& out) { out.setstate(std::ios::badbit); }),
               program::RunError);
  EXPECT_EQ(read_text_file(file), "old");
  EXPECT_EQ(parts(), 0);
}

}  // namespace hotpath::whole_file_test
