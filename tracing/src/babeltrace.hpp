// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <babeltrace2/babeltrace.h>

#include <memory>
#include <string>

namespace hotpath::tracing {

/// Releases a reference to an object of the library.
template <auto put>
struct Put {
  template <class T>
  void operator()(T* object) const {
    put(object);
  }
};
template <class T, auto put>
using Owned = std::unique_ptr<T, Put<put>>;
using OwnedGraph = Owned<bt_graph, bt_graph_put_ref>;
using OwnedValue = Owned<bt_value, bt_value_put_ref>;
using OwnedPlugin = Owned<const bt_plugin, bt_plugin_put_ref>;

/// The deepest cause of the library's last error.
std::string last_error();

/// A standard plugin. Throws std::runtime_error if it is not installed.
OwnedPlugin find_plugin(const char* name);

}  // namespace hotpath::tracing
