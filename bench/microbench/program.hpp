// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <benchmark/benchmark.h>

#include <cstring>

namespace hotpath::gbench {

/// Main function of a benchmark program: takes `--quick` from the command line, lets `register_all(quick)`
/// register the benchmarks, and leaves the rest to Google Benchmark. Returns the exit code.
template <class Register>
int run_program(int argc, char** argv, Register register_all) {
  bool quick = false;
  int kept = 1;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--quick") == 0) {
      quick = true;
    } else {
      argv[kept++] = argv[i];
    }
  }
  argc = kept;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  register_all(quick);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace hotpath::gbench
