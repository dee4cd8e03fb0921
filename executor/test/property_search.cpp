// SPDX-License-Identifier: Apache-2.0
// Searches random task sets and graphs for a counter-example to the properties of schedules, on
// this machine or, under mpirun, on several.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <numeric>
#include <set>
#include <sstream>

#include "hotpath/campaign/crew.hpp"
#include "properties.hpp"

namespace {

using hotpath::test::CaseResult;
using hotpath::test::Property;

struct Options {
  std::uint64_t sets = 1'000'000;
  std::uint64_t seed = 1;
  unsigned threads = 0;
  std::string only;
  std::string program;
};

/// Task sets per cell: enough to make the cost of handing out a cell negligible.
constexpr std::uint64_t kSetsOfACell = 64;

/// The results of some task sets; of two counter-examples the first one counts.
struct Found {
  std::uint64_t jobs = 0;
  std::uint64_t set = std::numeric_limits<std::uint64_t>::max();  ///< Task set of the counter-example.
  std::string wrong;

  [[nodiscard]] std::string packed() const {
    return std::to_string(jobs) + " " + std::to_string(set) + " " + wrong;
  }
  void add(const std::string& packed) {
    Found other;
    std::istringstream in(packed);
    in >> other.jobs >> other.set;
    std::getline(in.ignore(), other.wrong, '\0');
    jobs += other.jobs;
    if (other.set >= set) return;
    set = other.set;
    wrong = other.wrong;
  }
};

class Search {
 public:
  Search(const Options& options, std::vector<Property> properties)
      : options_(options), properties_(std::move(properties)) {}

  /// Exit code: 0 if no counter-example was found.
  int run() {
    hotpath::Crew crew(options_.threads);
    hotpath::Campaign campaign;
    campaign.name = options_.only + " " + std::to_string(options_.sets) + " " + std::to_string(options_.seed);
    campaign.cells.resize((options_.sets + kSetsOfACell - 1) / kSetsOfACell);
    std::iota(campaign.cells.begin(), campaign.cells.end(), 0);
    campaign.work = [this](std::uint64_t cell) { return look_at(cell).packed(); };
    campaign.gather = [&](std::uint64_t cell, const std::string& packed) {
      found_.add(packed);
      done_.insert(cell);
      show_progress(campaign.cells.size());
    };
    campaign.stopped = [this] { return first_is_known(); };
    crew.run(campaign);
    return crew.coordinates() ? report(crew) : 0;
  }

 private:
  double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  const Property& property_of(std::uint64_t set) const { return properties_[set % properties_.size()]; }
  std::uint64_t seed_of(std::uint64_t set) const { return options_.seed + set / properties_.size(); }

  /// Checks the task sets of one cell; consecutive sets alternate between the properties.
  Found look_at(std::uint64_t cell) const {
    Found results;
    const std::uint64_t end = std::min(options_.sets, (cell + 1) * kSetsOfACell);
    for (std::uint64_t set = cell * kSetsOfACell; set < end; ++set) {
      const CaseResult result = property_of(set).check(seed_of(set));
      results.jobs += result.jobs;
      if (result.wrong.empty()) continue;
      results.set = set;
      results.wrong = result.wrong;
      break;
    }
    return results;
  }

  /// Whether every task set before the counter-example was checked, so that the reported one does
  /// not depend on threads or ranks.
  bool first_is_known() const {
    if (found_.wrong.empty()) return false;
    const std::uint64_t cell = found_.set / kSetsOfACell;
    return std::distance(done_.begin(), done_.lower_bound(cell)) == static_cast<std::ptrdiff_t>(cell);
  }

  int report(const hotpath::Crew& crew) const {
    using Number = unsigned long long;
    if (!found_.wrong.empty()) {
      const std::string& name = property_of(found_.set).name;
      std::printf("%s does not hold: %s\nReproduce: %s --only %s --seed %llu --sets 1\n", name.c_str(),
                  found_.wrong.c_str(), options_.program.c_str(), name.c_str(), Number{seed_of(found_.set)});
      return 1;
    }
    std::printf(
        "%zu properties hold for %llu random task sets with %llu jobs; %.1f s on %u threads of %u ranks\n",
        properties_.size(), Number{options_.sets}, Number{found_.jobs}, elapsed_s(), crew.threads(),
        crew.ranks());
    std::fputs(hotpath::test::findings().c_str(), stdout);
    return 0;
  }

  void show_progress(std::size_t cells) {
    if (isatty(STDERR_FILENO) == 0 || elapsed_s() - shown_s_ < 0.5) return;
    shown_s_ = elapsed_s();
    const double left = shown_s_ * (static_cast<double>(cells) / static_cast<double>(done_.size()) - 1);
    std::fprintf(stderr, "\r%.0f %% of the sets, %.0f s left   ",
                 100 * static_cast<double>(done_.size()) / static_cast<double>(cells), left);
  }

  const Options options_;
  const std::vector<Property> properties_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double shown_s_ = 0;
  Found found_;
  std::set<std::uint64_t> done_;  // cells
};

}  // namespace

int main(int argc, char** argv) {
  std::vector<Property> properties = hotpath::test::properties();
  std::vector<std::string> names;
  for (const Property& property : properties) names.push_back(property.name);

  Options options;
  options.program = argv[0];
  CLI::App app(
      "Searches for a counter-example to the properties of schedules. Exit codes: 0 none found, 1 found, 2 "
      "wrong use");
  app.add_option("--sets", options.sets, "Total number of random task sets and graphs")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40).description(""));
  app.add_option("--seed", options.seed, "Seed of the first task set of each property")
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--threads", options.threads,
                 "Number of threads; 0: one per processor; does not affect the result")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(0U, 1024U).description(""));
  app.add_option("--only", options.only,
                 "Check only this property, named as in the report of a counter-example")
      ->type_name("NAME")
      ->check(CLI::IsMember(names).description(""));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (!options.only.empty()) {
    std::erase_if(properties, [&](const Property& p) { return p.name != options.only; });
  }
  return Search(options, std::move(properties)).run();
}
