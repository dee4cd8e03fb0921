// SPDX-License-Identifier: Apache-2.0
#include "watch/live_view.hpp"

#include <ncurses.h>
#include <unistd.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

namespace {

class Screen : public LiveView {
 public:
  explicit Screen(SCREEN* screen) : screen_(screen) {
    cbreak();
    noecho();
    nodelay(stdscr, TRUE);
    keypad(stdscr, TRUE);
    curs_set(0);
    if (has_colors()) {
      start_color();
      use_default_colors();
      init_pair(kBroken, COLOR_RED, -1);
    }
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen() override {
    endwin();
    delscreen(screen_);
  }

  ViewAction poll_keys() override {
    ViewAction action = ViewAction::none;
    for (int key = getch(); key != ERR; key = getch()) {
      if (key == 'q') return ViewAction::quit;
      if (key == 's') return ViewAction::snapshot;
      if (key == 'e' && !selection_.chain.empty()) return ViewAction::explain;
      if (!handle(key)) continue;
      action = ViewAction::redraw;
    }
    if (action == ViewAction::redraw) draw_all();
    return action;
  }

  void show(const ObservationReport& report, const std::string& incident) override {
    history_.remember(report);
    if (frozen_) return;
    report_ = report;
    incident_ = incident;
    draw();
  }

  std::string chain() const override { return selection_.chain; }

  void explain(const std::string& chain, std::vector<std::string> lines) override {
    if (chain != selection_.chain) return;
    selection_.explanation = std::move(lines);
    draw_all();
  }

  void say(const std::string& sentence) override {
    sentence_ = sentence;
    draw_all();
  }

 private:
  static constexpr short kBroken = 1;

  /// Whether the key changes what is shown.
  bool handle(int key) {
    switch (key) {
      case 'f':
        frozen_ = !frozen_;
        return true;
      case 'o':
        key_ = static_cast<SortKey>((static_cast<int>(key_) + 1) % 4);
        return true;
      case 'c':
        select_next();
        return true;
      case KEY_DOWN:
        ++first_;
        return true;
      case KEY_UP:
        first_ -= first_ > 0 ? 1 : 0;
        return true;
      default:
        return key == KEY_RESIZE;
    }
  }

  void select_next() {
    const std::vector<ObservationReport::Row>& chains = report_.chains().rows;
    const auto at = std::ranges::find(chains, selection_.chain, &ObservationReport::Row::name);
    const auto next = at == chains.end() ? chains.begin() : std::next(at);
    selection_ = {next == chains.end() ? "" : next->name, {}};
  }

  /// Also repairs what another program wrote on the screen.
  void draw_all() {
    clearok(stdscr, TRUE);
    draw();
  }

  void draw() {
    erase();
    const std::vector<ViewLine> lines = history_.lines(report_, key_, incident_, selection_);
    int row = 0;
    put(row++, lines.front());
    put(row++, {program::concat("q quit  f ", frozen_ ? "go on" : "freeze", "  o order: ", to_string(key_),
                                "  s snapshot  c chain  e explain  up/down  ", sentence_)});
    first_ = std::min(first_, lines.size() - 1);
    for (std::size_t i = 1 + first_; i < lines.size() && row < LINES; ++i) put(row++, lines[i]);
    refresh();
  }

  static void put(int row, const ViewLine& line) {
    if (line.title) attron(A_BOLD);
    if (line.broken) attron(COLOR_PAIR(kBroken));
    mvaddstr(row, 0, line.text.c_str());
    attrset(A_NORMAL);
  }

  SCREEN* const screen_;
  ViewLines history_;
  ObservationReport report_{false};
  std::string incident_, sentence_;
  ViewLines::Selection selection_;
  SortKey key_ = SortKey::nearness;
  std::size_t first_ = 0;
  bool frozen_ = false;
};

}  // namespace

std::unique_ptr<LiveView> open_live_view() {
  if (isatty(STDIN_FILENO) == 0 || isatty(STDOUT_FILENO) == 0) return nullptr;
  const pid_t foreground = tcgetpgrp(STDIN_FILENO);
  if (foreground >= 0 && foreground != getpgrp()) return nullptr;  // in the background it would be stopped
  std::setlocale(LC_CTYPE, "C.UTF-8");
  SCREEN* const screen = newterm(nullptr, stdout, stdin);
  return screen == nullptr ? nullptr : std::make_unique<Screen>(screen);
}

}  // namespace hotpath::watch
