// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <babeltrace2/babeltrace.h>

#include <memory>
#include <stdexcept>
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
inline std::string last_error() {
  const bt_error* const error = bt_current_thread_take_error();
  if (error == nullptr) return "libbabeltrace2 gives no reason";
  std::string message = bt_error_cause_get_message(bt_error_borrow_cause_by_index(error, 0));
  bt_error_release(error);
  return message;
}

/// A standard plugin. Throws std::runtime_error if it is not installed.
inline OwnedPlugin find_plugin(const char* name) {
  const bt_plugin* plugin = nullptr;
  if (bt_plugin_find(name, BT_TRUE, BT_FALSE, BT_TRUE, BT_FALSE, BT_FALSE, &plugin) !=
      BT_PLUGIN_FIND_STATUS_OK)
    throw std::runtime_error(std::string("libbabeltrace2 has no plugin `") + name + "`: " + last_error());
  return OwnedPlugin(plugin);
}

}  // namespace hotpath::tracing
