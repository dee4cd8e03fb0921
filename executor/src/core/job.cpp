// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/job.hpp"

namespace hotpath {

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::ran:
      return "ran";
    case Outcome::skipped:
      return "skipped";
    case Outcome::overwritten:
      return "overwritten";
    case Outcome::queued:
      return "queued";
    case Outcome::running:
      return "running";
    case Outcome::empty:
      return "empty";
  }
  return "?";
}

}  // namespace hotpath
