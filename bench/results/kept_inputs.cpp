// SPDX-License-Identifier: Apache-2.0
#include "results/kept_inputs.hpp"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>

#include "hotpath/core/input_file.hpp"
#include "program/hash.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"

namespace hotpath::results {

namespace fs = std::filesystem;

namespace {

std::string hash_of(const std::string& content) {
  return program::text("%016llx", static_cast<unsigned long long>(program::hash_of(content)));
}

std::string content_of(std::ifstream in) {
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

void keep_input(const RunFolder& folder, RunRecord& record, const std::string& kind, const fs::path& original,
                std::string name) {
  const std::string content = content_of(open_input(original, "it is an input of the run"));
  std::error_code ignored;
  const fs::path absolute = fs::absolute(original, ignored);
  if (name.empty()) name = program::concat("input_", kind, original.extension().string());
  program::create_folder((folder.path() / name).parent_path());
  folder.write(name, content);
  record.inputs.push_back({kind, name, absolute.lexically_normal(), hash_of(content)});
}

std::optional<fs::path> kept_input(const StoredRun& run, const std::string& kind) {
  const auto& inputs = run.record().inputs;
  const auto kept = std::ranges::find(inputs, kind, &InputRecord::kind);
  if (kept == inputs.end()) return std::nullopt;
  fs::path copy = run.folder() / fs::path(kept->file).filename();
  if (!fs::exists(copy)) run.fail("its file " + copy.string() + " is missing");
  static std::set<fs::path> warned;
  const std::ifstream original(kept->original);
  if (original && hash_of(content_of(std::ifstream(kept->original))) != kept->hash &&
      warned.insert(copy).second) {
    std::cerr << "warning: " << kept->original << " has changed since the run; its copy " << copy.string()
              << " is used\n";
  }
  return copy;
}

}  // namespace hotpath::results
