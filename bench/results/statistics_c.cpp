// SPDX-License-Identifier: Apache-2.0
// The statistics for the Python package (hotpath_report/statistics.py), which calls them with
// ctypes, so that all numbers of figures and pages come from one implementation. Estimates are
// {value, low, high}; NaN means no value.
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "hotpath/analysis/growth_test.hpp"
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

double hotpath_mean(const void* handle) { return hotpath::quantiles(samples(handle).pooled()).mean; }

void hotpath_quantile_estimate(const void* handle, double probability, double* out) {
  store(hotpath::estimate_quantiles(samples(handle), std::array{probability}).front(), out);
}

/// `out`: an estimate per probability, from one set of resamples.
void hotpath_quantile_estimates(const void* handle, const double* probabilities, std::size_t n, double* out) {
  for (const Estimate& e : hotpath::estimate_quantiles(samples(handle), std::span(probabilities, n))) {
    store(e, out);
    out += 3;
  }
}

void hotpath_quantile_ratio(const void* a, const void* b, double probability, double confidence,
                            double* out) {
  store(hotpath::ratio_of_quantiles(samples(a), samples(b), probability, {.confidence = confidence}), out);
}

void hotpath_quantile_difference(const void* a, const void* b, double probability, double* out) {
  store(hotpath::difference_of_quantiles(samples(a), samples(b), probability), out);
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

/// Tests the growth of one measure, with one value per repetition: `sizes[0]` values before and
/// `sizes[1]` after. `pairing` and `scale` are enumerators. `out`: before, after, growth, low and high
/// end of its interval, p-value, whether it is exact, and the growth that is detectable at the alarm
/// rate `detection[0]` with the probability `detection[1]`.
void hotpath_growth(const double* values, const std::size_t* sizes, int pairing, int scale,
                    const double* detection, double* out) {
  const auto unit = static_cast<hotpath::Scale>(scale);
  const hotpath::GrowthTest t = hotpath::test_growth({values, sizes[0]}, {values + sizes[0], sizes[1]},
                                                     static_cast<hotpath::Pairing>(pairing), unit);
  const std::array results = {t.before,
                              t.after,
                              t.growth,
                              t.interval.low,
                              t.interval.high,
                              t.p_value,
                              t.exact ? 1.0 : 0.0,
                              hotpath::detectable_growth(t, unit, detection[0], detection[1])};
  std::ranges::copy(results, out);
}

/// Holm's correction, in place.
void hotpath_holm(double* p_values, std::size_t n) {
  std::ranges::copy(hotpath::holm({p_values, n}), p_values);
}

}  // extern "C"
