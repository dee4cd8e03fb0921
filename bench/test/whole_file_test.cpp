// SPDX-License-Identifier: Apache-2.0
// Files that get their names when they are whole.
#include "program/whole_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "program/errors.hpp"

namespace hotpath {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(WholeFile, HoldsTextJsonOrWhatAFunctionWrites) {
  const fs::path file = fs::path(testing::TempDir()) / "whole_file.txt";
  write_whole_file(file, std::string("text"));
  EXPECT_EQ(content_of(file), "text");
  write_whole_file(file, nlohmann::json{{"a", 1}});
  EXPECT_EQ(content_of(file), "{\n  \"a\": 1\n}\n");
  write_whole_file(file, [](std::ostream& out) { out << 7; });
  EXPECT_EQ(content_of(file), "7");
  EXPECT_FALSE(fs::exists(file.string() + ".part"));
}

TEST(WholeFile, NamesTheOptionThatAskedForAFileThatCannotBeWritten) {
  const fs::path file = fs::path(testing::TempDir()) / "nowhere" / "file";
  EXPECT_THROW(write_whole_file(file, std::string("text")), RunError);
  try {
    write_whole_file(file, "--output", std::string("text"));
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_EQ(std::string(error.what()).find("--output: " + file.string()), 0U) << error.what();
  }
}

TEST(WholeFile, LeavesTheOldFileWhenTheNewOneIsNotWhole) {
  const fs::path file = fs::path(testing::TempDir()) / "whole_file_kept.txt";
  write_whole_file(file, std::string("old"));
  EXPECT_THROW(write_whole_file(file, [](std::ostream& out) { out.setstate(std::ios::badbit); }), RunError);
  EXPECT_EQ(content_of(file), "old");
  EXPECT_FALSE(fs::exists(file.string() + ".part"));
}

}  // namespace
}  // namespace hotpath
