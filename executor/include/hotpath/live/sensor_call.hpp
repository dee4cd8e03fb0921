// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlfcn.h>

namespace hotpath {

/// A function of the sensor that `hotpath watch` preloads; nullptr: this program runs without it.
template <class Function>
[[nodiscard]] Function* sensor_call(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

}  // namespace hotpath
