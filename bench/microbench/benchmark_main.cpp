// SPDX-License-Identifier: Apache-2.0
// Main function of the benchmark programs: takes `--quick` from the command line, lets the program register
// its benchmarks, and leaves the rest to Google Benchmark.
#include "microbench/measurement.hpp"

int main(int argc, char** argv) {
  char** const end = std::remove_if(argv + 1, argv + argc,
                                    [](const char* word) { return std::string_view(word) == "--quick"; });
  const bool quick = end != argv + argc;
  argc = static_cast<int>(end - argv);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  hotpath::microbench::register_all(quick);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
