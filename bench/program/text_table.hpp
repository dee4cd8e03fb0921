// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace hotpath::program {

/// A table that a command prints: a title, a header of one or two lines, and rows of cells.
class TextTable {
 public:
  struct Cell {
    std::string value;
    std::string below = {};  ///< A second line, for the interval of a value; empty: none.
    Cell(std::string v, std::string b = {}) : value(std::move(v)), below(std::move(b)) {}
    Cell(const char* v) : value(v) {}
  };

  /// `header`: one text per column, with at most one line break. If all are empty, there is no
  /// header. A column without any text is left out.
  TextTable(std::string title, const std::vector<std::string>& header);

  /// `cells`: one per column.
  void add_row(const std::vector<Cell>& cells);

  friend std::ostream& operator<<(std::ostream& out, const TextTable& table);

 private:
  using Line = std::vector<std::string>;  ///< A text for each column.
  const std::string title_;
  std::vector<Line> header_, lines_;
};

}  // namespace hotpath::program
