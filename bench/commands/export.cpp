// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "import/import_ctf.hpp"
#include "results/perfetto.hpp"

namespace hotpath::commands {

namespace {

struct CtfOptions {
  std::string run, output;
};

struct PerfettoOptions {
  std::string run, executor, output;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};

void export_perfetto(const PerfettoOptions& o) {
  const Time to = o.to_ms ? Time{} + from_ms(*o.to_ms) : kNever;
  if (o.to_ms && *o.to_ms <= o.from_ms) throw UsageError("export perfetto: --to must lie after --from");
  const results::StoredRun run(o.run, "export perfetto");
  const results::TraceWindow window{o.executor.empty() ? run.executors().front() : o.executor, o.repetition,
                                    Time{} + from_ms(o.from_ms), to};
  program::write_output_file(o.output, "--output",
                             [&](std::ostream& out) { results::write_perfetto(out, run, window); });
  std::cout << o.output << "\n";
}

}  // namespace

const Command kExport("Understand", 170, [](CLI::App& app) {
  CLI::App& parent = add_parent(app, "export", "Export a run to the format of another tool",
                                "hotpath export perfetto runs/first --output first.json");
  auto [ctf, copied] = add_command<CtfOptions>(
      parent, "ctf", "Export a run as a trace of ros2_tracing (CTF 1.8)",
      "hotpath export ctf runs/first --output traces/first",
      [](const CtfOptions& options) { imports::export_ctf(options.run, options.output); });
  add(ctf, "RUN", copied.run, "FOLDER", kRunHelp)->required();
  add(ctf, "--output", copied.output, "FOLDER", "New folder for the trace")->required();
  auto [perfetto, o] = add_command<PerfettoOptions>(
      parent, "perfetto", "Export jobs and messages of a run for ui.perfetto.dev",
      "hotpath export perfetto runs/first --output first.json --to 1000", export_perfetto);
  add(perfetto, "RUN", o.run, "FOLDER", kRunHelp)->required();
  add_output_file(perfetto, "--output", o.output, "File in Chrome's Trace Event Format")->required();
  add(perfetto, "--executors", o.executor, "NAME", kRunExecutorHelp);
  add(perfetto, "--repetition", o.repetition, {0, 1e9}, "N", kRunRepetitionHelp);
  add(perfetto, "--from", o.from_ms, {0, 1e12}, "MS", "Start of the window, after the run's epoch");
  add(perfetto, "--to", o.to_ms, {0, 1e12}, "MS", "End of the window; by default the end of the run");
});

}  // namespace hotpath::commands
