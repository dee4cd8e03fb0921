// SPDX-License-Identifier: Apache-2.0
// Compares the exact worst cases of hotpath under executors with several threads with those of a model of
// rclcpp, which takes every execution time in whole nanoseconds: both must be equal. Plants errors in the
// model and expects the comparison to find each.
#include <unordered_set>

#include "generator.hpp"
#include "hotpath_program.hpp"
#include "threads.hpp"

namespace independent {

namespace {

Worst worst_cases(const Graph& graph, const std::string& label, Planted planted = Planted::none) {
  constexpr std::size_t kMostStates = 2'500;
  Worst worst;
  std::unordered_set<std::string> met;
  std::vector<System> open;
  const auto follow = [&](const System& from, Nanoseconds instant) {
    Choices choices;
    do {
      System next = from;
      next.advance(instant, choices, worst);
      if (met.insert(next.key()).second) open.push_back(std::move(next));
    } while (choices.another());
  };
  follow(System(graph, label, planted), 0);
  while (!open.empty() && met.size() <= kMostStates) {
    System next = std::move(open.back());
    open.pop_back();
    follow(next, next.next());
  }
  worst.states = open.empty() ? met.size() : 0;
  return worst;
}

class Check {
 public:
  Check(std::string hotpath, std::string folder) : hotpath_(std::move(hotpath)), folder_(std::move(folder)) {}

  void check(std::uint64_t seed) {
    const std::size_t threads = 2 + seed / 2 % 2;
    const std::string file = folder_ + "/" + std::to_string(seed) + ".yaml", csv = folder_ + "/exact.csv";
    write_random_graph(seed, file, threads);
    const Graph graph = read_graph(file);
    std::map<std::string, Worst> mine;
    std::vector<std::string> labels;
    for (const char* const name : {"multi:", "multi-jazzy:", "cbg:", "cbg-3178:"}) {
      const std::string label = name + std::to_string(threads);
      const Worst worst = worst_cases(graph, label);
      if (worst.states == 0) ++too_large_;
      if (worst.states > 0) labels.push_back(label), mine[label] = worst;
    }
    std::filesystem::remove(csv);
    run_command("ulimit -t 20; " + hotpath_ + " analyze " + file + " --exact --phases given --cores " +
                    std::to_string(threads + 1) + " --platform timer_thread=raised --csv " + csv +
                    " --executors " + joined(labels),
                folder_ + "/exact.txt");
    std::map<std::string, std::map<Target, Nanoseconds>> exact;
    for (const Bound& b : read_bounds(csv)) {
      if (b.exact) {
        exact[b.executor][{b.kind, b.name}] = b.value;
      } else if (const auto& values = mine[b.executor].values; values.contains({b.kind, b.name})) {
        ++bounds_;
        const Nanoseconds value = values.at({b.kind, b.name});
        if (value > b.value && ++differences_ > 0)
          std::cout << file << ": " << b.executor << ": " << b.kind << " " << b.name << ": " << value
                    << ", bound of hotpath: " << b.value << "\n";
      }
    }
    for (const auto& [label, worst] : mine)
      exact.contains(label) ? compare(file, graph, label, worst, exact[label]) : void(++refused_);
  }

  int report() const {
    std::cout << explored_ << " explorations, " << states_ << " states, " << equal_ << " equal values, "
              << bounds_ << " bounds, " << too_large_ << " explorations too large here, " << refused_
              << " not explored by hotpath: " << differences_ << " differences\n";
    for (std::size_t p = 1; p < kPlanted; ++p)
      if (!found_[p]) std::cout << "planted error " << p << " was not found\n";
    const bool all = std::ranges::all_of(found_.begin() + 1, found_.end(), std::identity());
    return differences_ == 0 && all && explored_ > 10 * refused_ ? 0 : 1;
  }

 private:
  void compare(const std::string& file, const Graph& graph, const std::string& label, const Worst& worst,
               const std::map<Target, Nanoseconds>& exact) {
    const auto differing = [&exact](const Worst& of) {
      std::vector<Target> targets;
      for (const auto& [target, value] : exact) {
        const auto mine = of.values.find(target);
        if (!of.duplicates.contains(target) && (mine == of.values.end() || mine->second != value))
          targets.push_back(target);
      }
      for (const auto& [target, value] : of.values)
        if (target.first != "hot_path" && !exact.contains(target)) targets.push_back(target);
      return targets;
    };
    ++explored_;
    states_ += worst.states;
    const std::vector<Target> differ = differing(worst);
    const auto clear = [&](const auto& entry) { return !worst.duplicates.contains(entry.first); };
    equal_ += static_cast<std::size_t>(std::ranges::count_if(exact, clear)) - differ.size();
    differences_ += differ.size();
    for (const Target& target : differ) {
      const auto mine = worst.values.find(target);
      std::cout << file << ": " << label << ": " << target.first << " " << target.second << ": "
                << (mine == worst.values.end() ? -1 : mine->second)
                << ", hotpath: " << (exact.contains(target) ? exact.at(target) : -1) << "\n";
    }
    for (std::size_t p = 1; p < kPlanted && differ.empty(); ++p)
      found_[p] = found_[p] || !differing(worst_cases(graph, label, static_cast<Planted>(p))).empty();
  }

  std::string hotpath_, folder_;
  std::size_t explored_ = 0, states_ = 0, equal_ = 0, too_large_ = 0, refused_ = 0, bounds_ = 0,
              differences_ = 0;
  std::array<bool, kPlanted> found_{};
};

}  // namespace

}  // namespace independent

int main(int count, char** arguments) { return independent::run_check<independent::Check>(count, arguments); }
