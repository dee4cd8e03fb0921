// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "machine/machine.hpp"
#include "program/errors.hpp"

namespace hotpath {

namespace {

struct Arguments {
  double seconds = 1;
  std::string output;
};

void row(const char* name, const std::string& value) {
  std::printf("%-22s%s\n", name, value.empty() ? "unknown" : value.c_str());
}

std::string throttling(const Machine& m) {
  if (m.rt_runtime_us < 0) return "off";
  return std::to_string(m.rt_runtime_us) + " of " + std::to_string(m.rt_period_us) + " us";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : ", ") + w;
  return text;
}

void print(const Machine& m) {
  char text[160];
  row("processor", m.cpu_model + ", " + std::to_string(m.processors) + " cores");
  row("kernel", m.kernel + (m.preempt_rt ? ", PREEMPT_RT" : ""));
  row("distribution", m.distribution);
  row("virtual machine", m.hypervisor.empty() ? "no" : m.hypervisor);
  row("frequency governor", m.governor.empty() ? "none" : m.governor);
  row("turbo", m.turbo);
  row("real-time throttling", throttling(m));
  row("real-time threads", m.real_time_threads.empty() ? "no others" : joined(m.real_time_threads));
  row("timer slack", std::to_string(m.timer_slack_ns) + " ns");
  std::snprintf(text, sizeof(text), "%s, resolution %lld ns, a reading %.0f ns, of CPU time %.0f ns",
                m.clock_source.c_str(), static_cast<long long>(m.noise.clock_resolution.count()),
                m.noise.clock_cost_ns, m.noise.cpu_clock_cost_ns);
  row("clock", text);
  std::snprintf(text, sizeof(text), "%.2f", m.load_average);
  row("load average", text);
  std::snprintf(text, sizeof(text), "%.2f %% since boot", m.stolen_percent);
  row("stolen time", text);
  std::printf("\nHiccups of a busy thread in %.1f s, in microseconds:\n", to_ms(m.noise.length) / 1000);
  std::printf("%6s %10s %10s %10s %8s\n", "core", "p99", "p99.9", "max", "lost");
  for (const Hiccups& h : m.noise.cores) {
    std::printf("%6d %10.2f %10.2f %10.1f %6.2f %%\n", h.cpu, to_ms(h.p99) * 1000, to_ms(h.p999) * 1000,
                to_ms(h.max) * 1000, h.lost_percent);
  }
  std::fflush(stdout);
}

void write_json(const std::string& path, const Machine& machine) {
  std::ofstream out(path);
  out << to_json(machine).dump(2) << "\n" << std::flush;
  if (!out) throw UsageError("--output: " + path + " cannot be written");
}

}  // namespace

void add_machine_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* machine =
      app.add_subcommand("machine", "Say what this machine is like, and what it does to a measurement");
  machine->add_option("--duration", arguments->seconds, "Time to watch all cores for hiccups")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.01, 60.0).description(""))
      ->capture_default_str();
  machine->add_option("--output", arguments->output, "Store it as JSON, too")->type_name("FILE");
  machine->footer("Example:  hotpath machine --duration 10 --output machine.json");
  machine->callback([arguments] {
    const Machine m = read_machine(from_ms(arguments->seconds * 1000));
    print(m);
    for (const std::string& sentence : warnings(m)) std::cerr << "note: " << sentence << "\n";
    if (!arguments->output.empty()) write_json(arguments->output, m);
  });
}

}  // namespace hotpath
