// SPDX-License-Identifier: Apache-2.0
// Services that run ahead of their ranks (docs/response_bounds.md, "Service wait").
#include "busy_query.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::multiply;

/// Whether a job of the task may run ahead of its rank.
bool GraphBusyWindow::runs_ahead(TaskId id) const {
  return order_.service_wait > 0 && topology_.set()[id].service;
}

/// Work of the services that run ahead of their ranks within `t` of the window's start, which lie at least
/// the service wait apart.
std::int64_t GraphBusyWindow::services_work(const Query& q, std::int64_t t) const {
  if (order_.service_wait == 0) return 0;
  return multiply(t / order_.service_wait + 1, q.level->ahead(q.any_service || order_.by_deadline).work);
}

/// Work within `t` of the window's start that does not follow from query.timers.
std::int64_t GraphBusyWindow::work_besides(Query& q, std::int64_t t) const {
  q.services = services_work(q, t);
  return add(releases_work(t), q.services);
}

}  // namespace hotpath
