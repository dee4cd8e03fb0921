// SPDX-License-Identifier: Apache-2.0
#include "advise/stored_draw.hpp"

#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/deployment.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::advise {

namespace {

/// The options of `simulate` that are not those of the graph, which is scaled already.
std::vector<std::string> command_of(const simulated::Options& o) {
  std::vector<std::string> words = {"simulate", "--graph=" + o.graph};
  words.push_back(o.deployments.empty() ? "--executors=" + o.executors.front()
                                        : "--deployments=" + o.deployments.front());
  if (!o.phases_file.empty()) {
    words.push_back("--phases=" + o.phases_file);
  } else {
    words.push_back(program::concat("--phases=", to_string(o.phases)));
    if (o.phase_step_ms) words.back() += program::text(":%.17g", *o.phase_step_ms);
  }
  words.insert(words.end(),
               {program::text("--duration=%.17g", o.duration_s),
                program::text("--warm-up=%.17g", o.warm_up_s), program::concat("--seed=", o.seed)});
  if (o.entity_order != "creation") words.push_back("--entity-order=" + o.entity_order);
  return words;
}

}  // namespace

std::string store_first_draw(const Candidate& candidate, const setup::CommonOptions& options,
                             const std::filesystem::path& folder) {
  program::create_folder(folder);
  simulated::Options o;
  static_cast<setup::CommonOptions&>(o) = options;
  o.graph = folder / "graph.yaml";
  write_graph(o.graph, with_drawn_deliveries(candidate.graph, options.seed),
              {"The graph of one candidate, with the candidate's costs.", {}}, program::write_with_folder);
  o.load_percent = o.rate_percent = std::nullopt;
  o.copies = 1;
  o.repetitions = 1;
  o.threads = 1;
  o.executors.clear();
  o.deployments.clear();
  const std::string label = candidate.executor();
  if (candidate.spec.deployment) {
    Deployment plan = candidate.spec.deployment->plan;
    plan.name = candidate.name;
    o.deployments = {folder / "deployment.yaml"};
    program::write_whole_file(o.deployments.front(), deployment_yaml(candidate.graph, candidate.tasks, plan));
  } else {
    o.executors = {label};
  }
  o.output = folder / "run";
  o.command = command_of(o);
  simulated::store_simulation(o);
  return label;
}

void write_latencies(const std::filesystem::path& file, const std::vector<const Prediction*>& predictions,
                     std::size_t chain) {
  program::write_whole_file(file, [&](std::ostream& out) {
    out << kChainsCsvHeader << "\n";
    for (const Prediction* p : predictions) {
      if (!p->overload.empty()) continue;
      for (const results::Repetition& draw : p->draws) {
        Trace trace;
        trace.executor = p->candidate->name;
        trace.repetition = draw.trace.repetition;
        for (const ChainRecord& r : draw.trace.chains) {
          if (r.chain == chain) trace.chains.push_back(r);
        }
        write_chains_csv(out, p->candidate->tasks.set, setup::chain_names(p->candidate->graph), trace);
      }
    }
  });
}

}  // namespace hotpath::advise
