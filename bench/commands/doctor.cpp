// SPDX-License-Identifier: Apache-2.0
#include "commands/command.hpp"
#include "machine/machine.hpp"
#include "results/stored_summary.hpp"
#include "results/summary.hpp"

namespace hotpath::commands {

namespace {

struct DoctorArguments {
  double seconds = 1;
  std::string output, run;
  bool recover = false;
};

Table facts(const machine::Machine& m) {
  Table table("", {"", ""});
  const auto row = [&](const char* name, const std::string& value) {
    table.add_row({name, value.empty() ? "unknown" : value});
  };
  row("processor", m.cpu_model + ", " + std::to_string(m.processors) + " cores");
  row("kernel", m.kernel + (m.preempt_rt ? ", PREEMPT_RT" : ""));
  row("distribution", m.distribution);
  row("virtual machine", m.hypervisor.empty() ? "no" : "yes, " + m.hypervisor);
  row("frequency governor", m.governor.empty() ? "none" : m.governor);
  row("turbo", m.turbo);
  row("boot parameters", m.boot_parameters.empty() ? "none for scheduling" : m.boot_parameters);
  row("real-time throttling",
      m.rt_runtime_us < 0 ? "off" : concat(m.rt_runtime_us, " of ", m.rt_period_us, " us"));
  row("real-time threads", m.real_time_threads.empty() ? "no others" : joined(m.real_time_threads));
  row("timer slack", std::to_string(m.timer_slack_ns) + " ns");
  row("clock", m.clock_source + text(", resolution %lld ns, %.0f ns per reading, %.0f ns for CPU time",
                                     static_cast<long long>(m.noise.clock_resolution.count()),
                                     m.noise.clock_cost_ns, m.noise.cpu_clock_cost_ns));
  row("load average", fixed(m.load_average, 2));
  row("stolen time", fixed(m.stolen_percent, 2) + " % since boot");
  return table;
}

Table hiccups(const machine::Noise& noise) {
  Table table("Hiccups of a busy thread in " + fixed(to_s(noise.length), 1) + " s, in microseconds",
              {"core", "p99", "p99.9", "max", "lost"});
  for (const machine::Hiccups& h : noise.cores) {
    table.add_row({h.cpu, fixed(to_us(h.p99), 2), fixed(to_us(h.p999), 2), fixed(to_us(h.max), 1),
                   fixed(h.lost_percent, 2) + " %"});
  }
  return table;
}

void examine_machine(const DoctorArguments& arguments) {
  const machine::Machine m = machine::read_machine(from_s(arguments.seconds));
  std::cout << facts(m) << "\n" << hiccups(m.noise) << std::flush;
  for (const std::string& sentence : machine::warnings(m)) std::cerr << "note: " << sentence << "\n";
  program::show_json(m);
  if (!arguments.output.empty()) program::write_output_file(arguments.output, "--output", nlohmann::json(m));
}

void examine(const DoctorArguments& arguments) {
  const std::string& run = arguments.run;
  if (run.empty()) return examine_machine(arguments);
  if (arguments.recover) {
    const results::Summary summary = results::recover_run(run);
    std::size_t recovered = 0;
    for (const results::ExecutorSummary& e : summary.executors) recovered += e.repetitions;
    std::cout << "Recovered " << recovered << (recovered == 1 ? " repetition" : " repetitions")
              << " of a run that was killed.\n\n";
    results::write_table(std::cout, summary);
    return program::show_json(summary);
  }
  const results::CheckedRun checked = results::check_run(run);
  std::cout << run << ": " << checked.rows << " rows of jobs.csv, " << checked.repetitions
            << (checked.repetitions == 1 ? " repetition" : " repetitions")
            << ": a valid schedule: one job per thread at a time, no early job, no job after the end, "
               "nothing lost or duplicated\n";
  program::show_json({{"rows", checked.rows}, {"repetitions", checked.repetitions}});
}

}  // namespace

const Command kDoctor("Measure", 30, [](CLI::App& app) {
  auto [doctor, o] = add_command<DoctorArguments>(
      app, "doctor", "Examine this machine, or a stored run; recover a killed run",
      "hotpath doctor runs/first", examine);
  CLI::Option* const run = add(doctor, "RUN", o.run, "FOLDER",
                               "Folder of a run: check that its jobs form a valid schedule; by\n"
                               "default report this machine's configuration and how it disturbs\n"
                               "measurements");
  add(doctor, "--recover", o.recover, "Write the summary of a killed run from its finished repetitions")
      ->needs(run);
  add(doctor, "--duration", o.seconds, {0.01, 60}, "SECONDS", "Time to record hiccups on all cores")
      ->excludes(run);
  add_output_file(doctor, "--output", o.output, "Also write the report on the machine as JSON")
      ->excludes(run);
  add_json_option(doctor);
});

}  // namespace hotpath::commands
