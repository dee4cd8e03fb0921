// SPDX-License-Identifier: Apache-2.0
// The statistics for the Python package (hotpath_report/statistics.py), which calls them with
// ctypes, so that all numbers of figures and pages come from one implementation. Estimates are
// {value, low, high}; NaN means no value.
#include <algorithm>
#include <span>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "results/measures.hpp"

namespace {

using hotpath::Estimate;
using hotpath::RepeatedSamples;

void store(const Estimate& estimate, double* out) {
  out[0] = estimate.value;
  out[1] = estimate.interval ? estimate.interval->low : hotpath::kNoValue;
  out[2] = estimate.interval ? estimate.interval->high : hotpath::kNoValue;
}

const RepeatedSamples& samples(const void* handle) { return *static_cast<const RepeatedSamples*>(handle); }

}  // namespace

extern "C" {

/// The concatenated samples of `repetitions` repetitions, `sizes[r]` in repetition r. Free the
/// result with hotpath_samples_delete().
void* hotpath_samples_new(const double* values, const std::size_t* sizes, std::size_t repetitions) {
  std::vector<std::vector<double>> of_repetition;
  for (std::size_t r = 0; r < repetitions; ++r) {
    of_repetition.emplace_back(values, values + sizes[r]);
    values += sizes[r];
  }
  return new RepeatedSamples(std::move(of_repetition));
}

void hotpath_samples_delete(void* handle) { delete static_cast<RepeatedSamples*>(handle); }

/// Share of a count in percent; 0 of nothing.
double hotpath_percent_of(std::uint64_t part, std::uint64_t whole) {
  return hotpath::results::percent_of(part, whole);
}

/// `out`: an estimate per probability, from one set of resamples.
void hotpath_quantile_estimates(const void* handle, const double* probabilities, std::size_t n, double* out) {
  for (const Estimate& e : hotpath::estimate_quantiles(samples(handle), std::span(probabilities, n))) {
    store(e, out);
    out += 3;
  }
}

void hotpath_quantile_ratio(const void* a, const void* b, double probability, double* out) {
  store(hotpath::ratio_of_quantiles(samples(a), samples(b), probability), out);
}

double hotpath_rank_test(const void* a, const void* b) { return hotpath::rank_test(samples(a), samples(b)); }

/// `out`: slope, intercept.
void hotpath_fit_line(const double* x, const double* y, const double* weights, std::size_t n, double* out) {
  const hotpath::Line line = hotpath::fit_line({x, n}, {y, n}, {weights, n});
  out[0] = line.slope;
  out[1] = line.intercept;
}

void hotpath_cliffs_delta(const void* a, const void* b, double* out) {
  store(hotpath::cliffs_delta(samples(a), samples(b)), out);
}

}  // extern "C"
