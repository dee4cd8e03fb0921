// SPDX-License-Identifier: Apache-2.0
#include "import/import_ctf.hpp"

#include "program/errors.hpp"

namespace hotpath {

void import_ctf(const ImportCtfOptions&) { throw RunError("import ctf is not there yet"); }
void export_ctf(const std::string&, const std::string&) { throw RunError("export ctf is not there yet"); }

}  // namespace hotpath
