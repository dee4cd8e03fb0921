// SPDX-License-Identifier: Apache-2.0
#include "setup/revision.hpp"

namespace hotpath::setup {

const char* const kRevision = HOTPATH_REVISION;

}  // namespace hotpath::setup
