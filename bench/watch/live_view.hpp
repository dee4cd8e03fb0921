// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "watch/observation_report.hpp"

namespace hotpath::watch {

/// The order of the rows.
enum class SortKey : std::uint8_t { nearness, execution, rate, name };
constexpr auto enum_texts(SortKey) {
  return std::to_array<EnumText<SortKey>>({{SortKey::nearness, "nearest to breaking"},
                                           {SortKey::execution, "execution"},
                                           {SortKey::rate, "rate"},
                                           {SortKey::name, "name"}});
}

/// One line of the screen.
struct ViewLine {
  std::string text;  ///< UTF-8.
  bool broken = false, title = false;
};

/// What a terminal shows of a watched system: its chains, callbacks and threads, and the last minute of
/// chains and callbacks.
class ViewLines {
 public:
  /// A second has passed.
  void remember(const ObservationReport& report);
  /// The selected chain and its explanation.
  struct Selection {
    std::string chain = {};  ///< Empty: none.
    std::vector<std::string> explanation = {};
  };
  /// The lines of the report. `incident`: of the contract; empty: none.
  [[nodiscard]] std::vector<ViewLine> lines(const ObservationReport& report, SortKey key,
                                            const std::string& incident, const Selection& selection) const;

 private:
  static constexpr std::size_t kSeconds = 60;

  /// By section and row: worst ms of each second; -1: none.
  std::map<std::pair<std::string, std::string>, std::deque<double>> history_;
};

/// Values as bars, the largest one full; a blank for values below 0.
[[nodiscard]] std::string sparkline(const std::deque<double>& values);

/// What a key of the user asks for.
enum class ViewAction : std::uint8_t { none, quit, snapshot, explain, redraw };

/// The screen of a terminal during its lifetime.
class LiveView {
 public:
  virtual ~LiveView() = default;
  /// Handles pressed keys.
  virtual ViewAction poll_keys() = 0;
  /// Shows the report, unless it is frozen.
  virtual void show(const ObservationReport& report, const std::string& incident) = 0;
  /// The selected chain; empty: none.
  [[nodiscard]] virtual std::string chain() const = 0;
  /// Shows where the time of the chain went, if it is still the selected one.
  virtual void explain(const std::string& chain, std::vector<std::string> lines) = 0;
  /// A sentence below the title until the next one.
  virtual void say(const std::string& sentence) = 0;
};

/// nullptr: built without ncurses, or the terminal is unsuitable.
[[nodiscard]] std::unique_ptr<LiveView> open_live_view();

}  // namespace hotpath::watch
