// SPDX-License-Identifier: Apache-2.0
#include "babeltrace.hpp"

#include <stdexcept>

namespace hotpath::tracing {

std::string last_error() {
  const bt_error* const error = bt_current_thread_take_error();
  if (error == nullptr) return "libbabeltrace2 gives no reason";
  std::string message = bt_error_cause_get_message(bt_error_borrow_cause_by_index(error, 0));
  bt_error_release(error);
  return message;
}

OwnedPlugin find_plugin(const char* name) {
  const bt_plugin* plugin = nullptr;
  if (bt_plugin_find(name, BT_TRUE, BT_FALSE, BT_TRUE, BT_FALSE, BT_FALSE, &plugin) !=
      BT_PLUGIN_FIND_STATUS_OK)
    throw std::runtime_error(std::string("libbabeltrace2 has no plugin `") + name + "`: " + last_error());
  return OwnedPlugin(plugin);
}

}  // namespace hotpath::tracing
