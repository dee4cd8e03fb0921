// SPDX-License-Identifier: Apache-2.0
// The memory limit.
#include "program/memory_limit.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <limits>

namespace hotpath::memory_limit_test {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

class CgroupMemoryLimit : public testing::Test {
 protected:
  CgroupMemoryLimit() {
    std::string pattern = fs::temp_directory_path() / "hotpath_cgroup_XXXXXX";
    root_ = mkdtemp(pattern.data());
  }
  ~CgroupMemoryLimit() override { fs::remove_all(root_); }

  void write(const std::string& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << "\n";
  }

  fs::path root_;
};

TEST_F(CgroupMemoryLimit, IsThatOfTheGroupOrOfOneAbove) {
  write("memory/a/b/memory.limit_in_bytes", "9223372036854771712");
  write("memory/a/memory.limit_in_bytes", "4096");
  EXPECT_EQ(program::cgroup_memory_limit("3:cpu,cpuacct:/\n2:memory:/a/b\n", root_), 4096U);
  EXPECT_EQ(program::cgroup_memory_limit("3:cpu,cpuacct:/a\n", root_), kUnlimited);
}

TEST(CgroupFolder, IsThatOfTheControllerOrOfVersion2) {
  const std::string mixed = "0::/new\n3:cpu,cpuacct:/a\n2:cpuset:/b\n";
  EXPECT_EQ(program::cgroup_folder(mixed, "cpu", "/mount"), "/mount/cpu/a");
  EXPECT_EQ(program::cgroup_folder(mixed, "memory", "/mount"), "/mount/new");
  EXPECT_EQ(program::cgroup_folder("3:cpu,cpuacct:/a\n", "memory", "/mount"), "");
}

TEST_F(CgroupMemoryLimit, OfVersion2MayBeNone) {
  write("a/memory.max", "max");
  EXPECT_EQ(program::cgroup_memory_limit("0::/a\n", root_), kUnlimited);
  write("a/memory.max", "8192");
  EXPECT_EQ(program::cgroup_memory_limit("0::/a\n", root_), 8192U);
  write("memory.max", "1024");
  EXPECT_EQ(program::cgroup_memory_limit("0::/a/not_mounted_here\n", root_), 1024U);
}

TEST(MemoryLimit, IsAtMostWhatUlimitAllows) {
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit before{};
    ASSERT_EQ(getrlimit(resource, &before), 0);
    const rlim_t megabyte = 1 << 20;
    rlimit lower = before;
    lower.rlim_cur = megabyte;
    ASSERT_EQ(setrlimit(resource, &lower), 0);
    const std::uint64_t limit = program::memory_limit();
    ASSERT_EQ(setrlimit(resource, &before), 0);
    EXPECT_EQ(limit, megabyte);
  }
}

}  // namespace hotpath::memory_limit_test
