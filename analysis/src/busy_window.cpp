// SPDX-License-Identifier: Apache-2.0
#include "busy_window.hpp"

#include <algorithm>

namespace hotpath {

std::optional<std::int64_t> busy_window_response(const LevelTask& k, const Interference& higher,
                                                 const exact::Utilisation& utilisation, TimeModel model) {
  using exact::add, exact::multiply, exact::subtract;
  const std::int64_t blocked = blocking(k.longest_lower, model);
  const int load = utilisation.compare_to_one();
  const bool endless_at_one = blocked > 0 || k.jitter > 0 || higher.has_jitter();
  if (load > 0 || (load == 0 && endless_at_one)) return std::nullopt;

  const auto own_jobs = [&](std::int64_t t) { return exact::ceil_div(add(t, k.jitter), k.period); };
  const std::int64_t start = add(add(blocked, higher.once()), k.wcet);
  const std::int64_t window = *exact::least_fixed_point(start, [&](std::int64_t t) {
    return add(add(blocked, higher.before(t)), multiply(own_jobs(t), k.wcet));
  });

  const bool closed = ties_interfere(blocked, model);
  const std::int64_t jobs = own_jobs(window);
  std::int64_t response = 0;
  std::int64_t w = add(add(blocked, k.wcet - k.last_part), higher.once());
  for (std::int64_t q = 0; q < jobs; ++q) {
    const std::int64_t fixed = add(blocked, subtract(multiply(q + 1, k.wcet), k.last_part));
    w = *exact::least_fixed_point(
        w, [&](std::int64_t t) { return add(fixed, closed ? higher.through(t) : higher.before(t)); });
    response = std::max(response, add(add(w, k.last_part), k.jitter) - multiply(q, k.period));
    w = add(w, k.wcet);
  }
  return response;
}

}  // namespace hotpath
