// SPDX-License-Identifier: Apache-2.0
#include "program/json_output.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>

#include "program/errors.hpp"
#include "program/whole_file.hpp"

namespace hotpath::program {

namespace {

using nlohmann::json;

int reserved = -1;  ///< Descriptor of the original standard output, once it is for JSON alone.

[[noreturn]] void fail() {
  throw RunError(std::string("--json: standard output cannot be written (") + std::strerror(errno) + ")");
}

}  // namespace

void reserve_output_for_json() {
  if (reserved >= 0) return;
  std::cout << std::flush;
  std::fflush(stdout);
  reserved = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (reserved < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) fail();
}

void show_json(const json& document) {
  if (reserved < 0) return;
  FileStream out(fcntl(reserved, F_DUPFD_CLOEXEC, reserved));
  out << document.dump(2, ' ', false, json::error_handler_t::replace) << "\n";
  out.close();
  if (!out) fail();
}

}  // namespace hotpath::program
