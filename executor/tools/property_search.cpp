// SPDX-License-Identifier: Apache-2.0
// Looks for a counter-example to the properties of schedules among random task sets and graphs, as many as
// one has time for.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <optional>
#include <thread>

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

class Search {
 public:
  Search(const Options& options, std::vector<Property> properties)
      : options_(options), properties_(std::move(properties)) {}

  /// Exit code: 0 if no counter-example was found.
  int run() {
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < options_.threads; ++i) threads.emplace_back([this] { work(); });
    if (isatty(STDERR_FILENO)) show_progress();
    for (std::thread& thread : threads) thread.join();
    const double seconds = elapsed_s();
    if (found_) {
      std::printf("%s does not hold: %s\nReproduce: %s --only %s --seed %llu --sets 1\n",
                  found_->property.c_str(), found_->wrong.c_str(), options_.program.c_str(),
                  found_->property.c_str(), static_cast<unsigned long long>(found_->seed));
      return 1;
    }
    std::printf("%zu properties hold for %llu random task sets with %llu jobs; %.1f s on %u threads\n",
                properties_.size(), static_cast<unsigned long long>(options_.sets),
                static_cast<unsigned long long>(jobs_.load()), seconds, options_.threads);
    std::fputs(hotpath::test::findings().c_str(), stdout);
    return 0;
  }

 private:
  struct CounterExample {
    std::uint64_t set;
    std::string property, wrong;
    std::uint64_t seed;
  };

  double elapsed_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }

  /// The sets go round the properties. Every set before the first counter-example is looked at, so that the
  /// one reported does not depend on the number of threads.
  void work() {
    for (std::uint64_t set = next_++; set < limit_; set = next_++) {
      const Property& property = properties_[set % properties_.size()];
      const std::uint64_t seed = options_.seed + set / properties_.size();
      const CaseResult result = property.check(seed);
      jobs_ += result.jobs;
      ++done_;
      if (result.wrong.empty()) continue;
      const std::lock_guard lock(mutex_);
      if (found_ && found_->set < set) continue;
      found_ = CounterExample{set, property.name, result.wrong, seed};
      limit_ = set;
    }
  }

  void show_progress() const {
    while (done_ < limit_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      const std::uint64_t done = done_;
      if (done == 0) continue;
      const double left = elapsed_s() * (static_cast<double>(options_.sets) / static_cast<double>(done) - 1);
      std::fprintf(stderr, "\r%llu of %llu sets, %.0f s left   ", static_cast<unsigned long long>(done),
                   static_cast<unsigned long long>(options_.sets), left);
    }
    std::fprintf(stderr, "\r\033[K");
  }

  const Options options_;
  const std::vector<Property> properties_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::atomic<std::uint64_t> next_ = 0, done_ = 0, jobs_ = 0, limit_ = options_.sets;
  std::mutex mutex_;
  std::optional<CounterExample> found_;
};

}  // namespace

int main(int argc, char** argv) {
  std::vector<Property> properties = hotpath::test::properties();
  std::vector<std::string> names;
  for (const Property& property : properties) names.push_back(property.name);

  Options options;
  options.program = argv[0];
  CLI::App app(
      "Looks for a counter-example to the properties of schedules. Exit codes: 0 none found, 1 found, 2 "
      "wrong use");
  app.add_option("--sets", options.sets, "Random task sets and graphs in all")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40).description(""));
  app.add_option("--seed", options.seed, "Of the first set of each property")
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "0: one for each processor; the result does not depend on it")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(0U, 1024U).description(""));
  app.add_option("--only", options.only, "One property, as in the report of a counter-example")
      ->type_name("NAME")
      ->check(CLI::IsMember(names).description(""));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (options.threads == 0) options.threads = std::max(1U, std::thread::hardware_concurrency());
  if (!options.only.empty()) {
    std::erase_if(properties, [&](const Property& p) { return p.name != options.only; });
  }
  return Search(options, std::move(properties)).run();
}
