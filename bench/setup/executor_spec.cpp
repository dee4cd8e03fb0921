// SPDX-License-Identifier: Apache-2.0
#include "setup/executor_spec.hpp"

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::setup {

namespace {

void apply_variant(ExecutorSpec& spec, const std::string& variant) {
  const bool has_rules = spec.entry->traits.family == Family::priority_events;
  if (const auto threads = parse<unsigned>(variant); spec.entry->traits.many_workers && threads) {
    const unsigned most = most_threads(spec.entry->traits);
    if (*threads < 1 || *threads > most) {
      throw program::UsageError(program::concat("executor `", spec.label,
                                                "`: the number of threads must lie between 1 and ", most));
    }
    spec.scheduler.workers = *threads;
  } else if (const auto rule = parse<SubscriptionRule>(variant); has_rules && rule) {
    spec.scheduler.rule = *rule;
  } else if (const auto ties = parse<Ties>(variant); has_rules && ties) {
    spec.scheduler.ties = *ties;
  } else {
    throw program::UsageError(
        "executor `" + spec.label + "` has no variant `" + variant +
        "`; the paper's executors accept inherit, first, lifo, fifo; multi, multi-jazzy, "
        "multi-fair, cbg, cbg-3178 accept a number of threads");
  }
}

}  // namespace

ExecutorSpec parse_executor(const std::string& label, const SchedulerOptions& defaults) {
  const results::ExecutorLabel parts(label);
  ExecutorSpec spec{label, find_executor(parts.name), defaults};
  const bool known_stack = parts.stack.empty() || parts.on_rclcpp();
  if (spec.entry == nullptr || !known_stack) {
    throw program::UsageError("there is no executor `" + (known_stack ? parts.name : label) + "`; " +
                              suggest(parts.name, all_executor_names()));
  }
  if (!parts.stack.empty()) spec.stack = Stack::rclcpp;
  spec.plan.description = spec.entry->description;
  for (const std::string& variant : parts.variants) apply_variant(spec, variant);
  return spec;
}

std::string name_with_rules(const ExecutorEntry& entry, const SchedulerOptions& scheduler) {
  std::string name(entry.name);
  if (entry.traits.family != Family::priority_events) return name;
  if (scheduler.rule != SchedulerOptions{}.rule) name += program::concat(":", to_string(scheduler.rule));
  if (scheduler.ties != SchedulerOptions{}.ties) name += program::concat(":", to_string(scheduler.ties));
  return name;
}

unsigned job_threads(const ExecutorSpec& executor) {
  const bool timer_thread = executor.entry->traits.timers != TimerHandling::polled;
  return worker_count(*executor.entry, executor.scheduler) - (timer_thread ? 1 : 0);
}

ExecutorSpec deploy(Deployment plan, const SchedulerOptions& defaults) {
  if (find_executor(plan.name) != nullptr) {
    throw InputError(plan.file, 1, "the deployment has the name of an executor, " + plan.name,
                     "rename the deployment");
  }
  std::vector<ExecutorSpec> executors;
  std::uint32_t workers = 0;
  for (const DeployedExecutor& e : plan.executors) {
    try {
      executors.push_back(parse_executor(e.executor, defaults));
    } catch (const program::UsageError& error) {
      throw InputError(plan.file, e.line, error.what(), "take one of `hotpath list executors`");
    }
    ExecutorSpec& part = executors.back();
    part.place = e;
    part.first_worker = workers;
    workers += worker_count(*part.entry, part.scheduler);
    const bool raises = part.entry->traits.raises_timer_thread;
    const bool budget = e.policy.scheduling_class == ThreadPolicy::Class::deadline;
    if (raises && (budget || e.policy.priority >= kHighestPriority)) {
      throw InputError(plan.file, e.line,
                       program::concat("executor ", e.name, ": a timer thread cannot have a priority above ",
                                       to_string(e.policy)),
                       program::concat("take fifo with a priority below ", kHighestPriority));
    }
  }
  const std::string label = plan.name;
  return {label, nullptr, defaults, Stack::native, std::move(plan), std::move(executors)};
}

std::vector<std::string> paper_executor_names() {
  std::vector<std::string> names = all_executor_names();
  std::erase_if(names,
                [](const std::string& name) { return !find_executor(name)->traits.compared_by_paper; });
  return names;
}

std::vector<std::string> all_executor_names() {
  std::vector<std::string> names;
  for (const ExecutorEntry& e : executors()) names.emplace_back(e.name);
  return names;
}

}  // namespace hotpath::setup
