// SPDX-License-Identifier: Apache-2.0
// The folder of a run, of which one file (HOTPATH_FUZZED_FILE) is the input and the others are as a program
// wrote them: everything that `hotpath summarize` does with it.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fuzz.hpp"
#include "results/stored_run.hpp"
#include "results/summary_table.hpp"

namespace {

namespace fs = std::filesystem;

/// A copy of the folder with a link to the input in place of the fuzzed file; libFuzzer's processes each
/// have one, and it goes with them.
class Folder {
 public:
  explicit Folder(const std::string& input) {
    for (const char* name : {"run.json", "jobs.csv", "chains.csv"}) {
      fs::create_symlink(fs::path(HOTPATH_FUZZED_RUN) / name, path_ / name);
    }
    fs::remove(path_ / HOTPATH_FUZZED_FILE);
    fs::create_symlink(input, path_ / HOTPATH_FUZZED_FILE);
  }
  ~Folder() { fs::remove_all(path_); }
  const fs::path& path() const { return path_; }

 private:
  static fs::path create() {
    std::string path = (fs::temp_directory_path() / "hotpath_fuzz_XXXXXX").string();
    if (mkdtemp(path.data()) == nullptr) std::abort();
    return path;
  }
  const fs::path path_ = create();
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hotpath;
  static fuzz::InputFile file;
  static const Folder folder(file.hold(nullptr, 0));
  file.hold(data, size);
  return fuzz::read_or_refuse([&] {
    StoredRun run(folder.path(), "summarize");
    run.load();
    SummaryOptions options = run.summary_options();
    options.bootstrap.resamples = 10;
    const Summary summary = summarize(run.tasks(), run.runs(), options);
    static_cast<void>(nlohmann::json(summary).dump());
    std::ostringstream out;
    write_table(out, summary);
    write_responses_csv(out, run);
  });
}
