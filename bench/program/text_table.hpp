// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace hotpath {

/// A table that a command prints: a title, a header of one or two lines, and rows of cells.
class TextTable {
 public:
  struct Cell {
    std::string value;
    std::string below = {};  ///< A second line, for the interval of a value; empty: none.
    Cell(std::string v, std::string b = {}) : value(std::move(v)), below(std::move(b)) {}
    Cell(const char* v) : value(v) {}
  };

  /// `header`: one text per column; a line break in it makes two lines. All empty: there is no header.
  /// A column without any text is left out.
  TextTable(std::string title, std::vector<std::string> header);

  /// `cells`: one per column.
  void add_row(std::vector<Cell> cells) { rows_.push_back(std::move(cells)); }

  bool empty() const { return rows_.empty(); }

  friend std::ostream& operator<<(std::ostream& out, const TextTable& table);

 private:
  /// The first column and all with words are aligned left, those with numbers alone right.
  bool left_aligned(std::size_t column) const;
  std::vector<std::size_t> widths() const;
  /// One of a row's two lines, if it has any text.
  void write_line(std::ostream& out, const std::vector<Cell>& row, std::string Cell::*line) const;

  const std::string title_;
  std::vector<Cell> header_;  ///< Those of one line are `below`.
  std::vector<std::vector<Cell>> rows_;
};

}  // namespace hotpath
