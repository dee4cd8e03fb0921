// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "guarantees/analyze.hpp"

namespace hotpath::watch {

/// The contract of a graph under the only executor of `options`, as YAML: budgets, periods and depths
/// of the graph, and the bounds and distances that follow from them for any phases. Throws UsageError
/// and InputError.
[[nodiscard]] std::string stated_contract(const guarantees::AnalyzeOptions& options);

}  // namespace hotpath::watch
