// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath::page {

/// An interval since the epoch of a repetition.
using Interval = std::pair<Time, Time>;

using Column = std::vector<std::int64_t>;

/// Named columns of equal length; bench/hotpath_report/web/README.md explains them.
template <std::size_t N>
struct Columns {
  std::array<const char*, N> names;
  std::array<Column, N> columns{};

  [[nodiscard]] std::size_t size() const { return columns.front().size(); }
  /// Adds a row; its values are in the order of the names.
  void add(const std::array<std::int64_t, N>& row) {
    for (std::size_t c = 0; c < N; ++c) columns[c].push_back(row[c]);
  }
  /// An array by name.
  [[nodiscard]] nlohmann::json json() const {
    nlohmann::json all;
    for (std::size_t c = 0; c < N; ++c) all[names[c]] = columns[c];
    return all;
  }
};

}  // namespace hotpath::page
