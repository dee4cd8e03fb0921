// SPDX-License-Identifier: Apache-2.0
#include "program/json_output.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "program/errors.hpp"
#include "program/whole_file.hpp"

namespace hotpath::program {

namespace {

using nlohmann::json;

int reserved = -1;  ///< Descriptor of the original standard output.

[[noreturn]] void fail() {
  throw RunError(std::string("--json: standard output cannot be written (") + std::strerror(errno) + ")");
}

/// The next line's fields; quotes as csv_field() writes them.
std::vector<std::string> take_row(std::string_view& csv) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  std::size_t i = 0;
  for (; i < csv.size() && (quoted || csv[i] != '\n'); ++i) {
    if (csv[i] == '"' && quoted && i + 1 < csv.size() && csv[i + 1] == '"') {
      fields.back() += csv[i++];
    } else if (csv[i] == '"') {
      quoted = !quoted;
    } else if (csv[i] == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += csv[i];
    }
  }
  csv.remove_prefix(std::min(i + 1, csv.size()));
  return fields;
}

json value_of(const std::string& field) {
  if (field.empty()) return nullptr;
  const char* const end = field.data() + field.size();
  std::int64_t whole = 0;
  if (const auto parsed = std::from_chars(field.data(), end, whole);
      parsed.ptr == end && parsed.ec == std::errc())
    return whole;
  double number = 0;
  const auto parsed = std::from_chars(field.data(), end, number);
  if (parsed.ptr == end && parsed.ec == std::errc() && std::isfinite(number)) return number;
  return field;
}

}  // namespace

void reserve_output_for_json() {
  if (prints_json()) return;
  std::cout << std::flush;
  std::fflush(stdout);
  reserved = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (reserved < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) fail();
}

bool prints_json() { return reserved >= 0; }

void show_json(const json& document) {
  if (!prints_json()) return;
  FileStream out(fcntl(reserved, F_DUPFD_CLOEXEC, reserved));
  out << document.dump(2, ' ', false, json::error_handler_t::replace) << "\n";
  out.close();
  if (!out) fail();
}

void show_rows(const std::string& csv) {
  std::string_view left = csv;
  const std::vector<std::string> header = take_row(left);
  json rows = json::array();
  while (!left.empty()) {
    const std::vector<std::string> fields = take_row(left);
    json& row = rows.emplace_back(json::object());
    for (std::size_t i = 0; i < header.size() && i < fields.size(); ++i) row[header[i]] = value_of(fields[i]);
  }
  show_json(rows);
}

}  // namespace hotpath::program
