// SPDX-License-Identifier: Apache-2.0
#include "machine/machine.hpp"
#include "program/json_record.hpp"

namespace hotpath::machine {

void fields(auto& visit, program::MaybeConst<Hiccups> auto& hiccups) {
  visit("cpu", hiccups.cpu);
  visit.ns("p99_ns", hiccups.p99);
  visit.ns("p999_ns", hiccups.p999);
  visit.ns("max_ns", hiccups.max);
  visit("lost_percent", hiccups.lost_percent);
}

void fields(auto& visit, program::MaybeConst<Noise> auto& noise) {
  visit.ms("watched_ms", noise.length);
  visit("hiccups", noise.cores);
  visit.ns("clock_resolution_ns", noise.clock_resolution);
  visit("clock_cost_ns", noise.clock_cost_ns);
  visit("cpu_clock_cost_ns", noise.cpu_clock_cost_ns);
}

static void visit_fields(auto& visit, program::MaybeConst<Machine> auto& machine) {
  visit("cpu_model", machine.cpu_model);
  visit("processors", machine.processors);
  visit("kernel", machine.kernel);
  visit("preempt_rt", machine.preempt_rt);
  visit("distribution", machine.distribution);
  visit("governor", machine.governor);
  visit("hypervisor", machine.hypervisor);
  visit("rt_runtime_us", machine.rt_runtime_us);
  visit("rt_period_us", machine.rt_period_us);
  visit("load_average", machine.load_average);
  visit("compiler", machine.compiler);
  visit("build_type", machine.build_type);
  visit("turbo", machine.turbo);
  visit.if_stored("boot_parameters", machine.boot_parameters);
  visit("clock_source", machine.clock_source);
  visit("timer_slack_ns", machine.timer_slack_ns);
  visit("stolen_percent", machine.stolen_percent);
  visit("real_time_threads", machine.real_time_threads);
  visit("noise", machine.noise);
}

void to_json(nlohmann::json& j, const Machine& machine) {
  j = nlohmann::json::object();
  program::JsonWriter write(j);
  visit_fields(write, machine);
}

void from_json(const nlohmann::json& j, Machine& machine) {
  program::JsonReader read(j);
  visit_fields(read, machine);
}

}  // namespace hotpath::machine
