// SPDX-License-Identifier: Apache-2.0
// Does the work of `hotpath report --summary` on a run's folder, in which the input replaces the file
// HOTPATH_FUZZED_FILE.
#include <sstream>

#include "fuzz.hpp"
#include "results/stored_summary.hpp"
#include "results/summary.hpp"

namespace {

namespace fs = std::filesystem;
using namespace hotpath;

/// A copy of the folder with a link to the input in place of the fuzzed file.
class RunWithInput {
 public:
  explicit RunWithInput(const std::string& input) {
    for (const char* name : {"run.json", "jobs.csv", "chains.csv"}) {
      fs::create_symlink(fs::path(HOTPATH_FUZZED_RUN) / name, path() / name);
    }
    fs::remove(path() / HOTPATH_FUZZED_FILE);
    fs::create_symlink(input, path() / HOTPATH_FUZZED_FILE);
  }
  const fs::path& path() const { return folder_.path(); }

 private:
  const fuzz::TemporaryFolder folder_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static fuzz::InputFile file;
  static const RunWithInput folder(file.hold(nullptr, 0));
  file.hold(data, size);
  return fuzz::read_or_refuse([&] {
    results::StoredRun run(folder.path(), "summarize");
    results::SummaryOptions options = run.summary_options();
    options.bootstrap.resamples = 10;
    std::ostringstream out;
    const results::Summary summary = summarize(run, options);
    static_cast<void>(results::response_samples(run));
    static_cast<void>(nlohmann::json(summary).dump());
    write_table(out, summary);
    run.load(TaskSet(run.tasks()));
  });
}
