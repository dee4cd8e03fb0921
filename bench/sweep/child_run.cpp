// SPDX-License-Identifier: Apache-2.0
#include "sweep/child_run.hpp"

#include <cstdlib>

#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "results/stored_summary.hpp"

namespace hotpath::sweep {

void run_hotpath(std::vector<std::string> words, const std::string& program) {
  words.insert(words.begin(), program.empty() ? program::own_program() : program);
  static const int once = setenv("HOTPATH_FIGURES", "none", 1);  // threads read the environment
  (void)once;
  auto [status, errors] = program::run_program(std::move(words), true);
  if (program::exited_with(status, 0)) return;
  while (errors.ends_with('\n')) errors.pop_back();
  errors = errors.substr(errors.rfind('\n') + 1);
  constexpr std::string_view kOurName = "hotpath: ";
  if (errors.starts_with(kOurName)) errors.erase(0, kOurName.size());
  if (errors.empty()) errors = program::how_it_ended(status);
  if (program::exited_with(status, 2)) throw program::UsageError(errors);
  throw program::RunError(errors);
}

results::Summary summary_of_folder(const std::filesystem::path& folder) {
  const results::StoredRun run(folder, "a run");
  return results::summarize(run, run.summary_options());
}

}  // namespace hotpath::sweep
