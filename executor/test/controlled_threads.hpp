// SPDX-License-Identifier: Apache-2.0
// A world of threads for BasicExecutor in which a test decides at each step which thread continues.
// Threads are fibers of one real thread. Time advances only by steps of 1 ns and by jumps to the
// next instant for which a thread waits.
#pragma once

#include <ucontext.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/live/executor.hpp"

namespace hotpath::test {

/// Chooses the next step. Of `options` >= 2, the first `free` ones (>= 1) disturb no thread: the
/// running thread continues, or, if it waits, another one, or, if all wait, time passes. The other
/// options preempt the running thread, let time pass meanwhile, or wake a parked thread spuriously.
class Choices {
 public:
  virtual ~Choices() = default;
  virtual std::size_t choose(std::size_t options, std::size_t free) = 0;
};

/// A deliberate defect.
enum class Fault {
  none,
  ticket_ignored,  ///< A thread woken just before it sleeps does not notice.
  early_is_due,    ///< A thread woken spuriously believes that the awaited instant has come.
  group_ignored,   ///< The executor treats a mutually exclusive callback group as reentrant.
};

class World {
 public:
  /// Number, from 1, of the notification that is lost; 0: none.
  World(Choices& choices, Fault broken, std::size_t lost = 0)
      : fault(broken), choices_(choices), lost_(lost) {
    current_world = this;
    fibers_.push_back(std::make_unique<Fiber>());  // the test's own thread
  }
  ~World() { current_world = nullptr; }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  static World& current() { return *current_world; }
  const Fault fault;
  /// Called when all threads wait, before time jumps.
  std::function<void()> when_idle = [] {};
  /// The first problem; empty if there is none.
  std::string defect;

  Time now() {
    clock_ += Duration(1);
    return std::max(clock_, std::exchange(believed_, Time{}));
  }
  /// The time that the next thread observes.
  void believe(Time instant) { believed_ = instant; }

  /// Whether the next notification is delivered.
  bool notify() { return ++notifications_ != lost_; }
  std::size_t notifications() const { return notifications_; }

  std::size_t start(std::function<void()> body) {
    Fiber& fiber = *fibers_.emplace_back(std::make_unique<Fiber>());
    fiber.body = std::move(body);
    fiber.stack = take_stack();
    getcontext(&fiber.context);
    fiber.context.uc_stack.ss_sp = fiber.stack.get();
    fiber.context.uc_stack.ss_size = kStack;
    makecontext(&fiber.context, run_current, 0);
    return fibers_.size() - 1;
  }

  bool ended(std::size_t fiber) const { return fibers_[fiber]->ended; }

  /// Point at which another thread may continue.
  void step() {
    wait([] { return true; });
  }

  /// Waits until `ready`, or until an instant. `early`: the wait may end spuriously.
  void wait(std::function<bool()> ready, Time until = kNever, bool early = false) {
    Fiber& self = *fibers_[running_];
    self.ready = std::move(ready);
    self.until = until;
    self.early = early;
    go_on();
  }

 private:
  static constexpr std::size_t kStack = 64 << 10;
  using Stack = std::unique_ptr<char[]>;
  struct Fiber {
    ucontext_t context{};
    Stack stack;
    std::function<void()> body;
    std::function<bool()> ready = [] { return true; };
    Time until = kNever;
    bool early = false;
    bool ended = false;
  };

  static std::vector<Stack>& stacks() {
    static std::vector<Stack> unused;
    return unused;
  }
  static Stack take_stack() {
    if (stacks().empty()) return Stack(new char[kStack]);
    Stack stack = std::move(stacks().back());
    stacks().pop_back();
    return stack;
  }

  static void run_current() {
    World& world = current();
    world.fibers_[world.running_]->body();
    world.fibers_[world.running_]->ended = true;
    stacks().push_back(
        std::move(world.fibers_[world.running_]->stack));  // not reused before this fiber has left it
    world.go_on();
  }

  bool may_go_on(std::size_t f) const {
    const Fiber& fiber = *fibers_[f];
    return !fiber.ended && (fiber.until <= clock_ || fiber.ready());
  }

  /// The next instant for which a thread waits.
  Time next_instant() const {
    Time next = kNever;
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      if (!fibers_[f]->ended && !may_go_on(f)) next = std::min(next, fibers_[f]->until);
    }
    return next;
  }

  /// Allocates nothing: a thread that has ended never resumes to release memory.
  void go_on() {
    std::array<std::size_t, kMostThreads + 1> options{};
    std::size_t count = 0;
    const bool goes_on = may_go_on(running_);
    if (goes_on) options[count++] = running_;
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      if (f != running_ && may_go_on(f)) options[count++] = f;
    }
    const std::size_t able = count;
    if (able == 0) when_idle();
    const Time next = next_instant();
    if (able == 0 && next == kNever) {
      break_deadlock();
      return go_on();
    }
    if (next != kNever) options[count++] = kTimePasses;  // also while a thread could continue
    for (std::size_t f = 0; f < fibers_.size(); ++f) {
      if (fibers_[f]->early && !fibers_[f]->ended && !may_go_on(f)) options[count++] = f;
    }
    const std::size_t free = goes_on || able == 0 ? 1 : able;
    const std::size_t chosen = options[count < 2 ? 0 : choices_.choose(count, free)];
    if (chosen != kTimePasses) return switch_to(chosen);
    clock_ = next;
    go_on();
  }

  /// Lets the threads of a broken executor end.
  void break_deadlock() {
    if (defect.empty()) defect = "all threads wait for ever";
    bool broken = false;
    for (const auto& fiber : fibers_) {
      if (fiber->ended || !fiber->early) continue;
      fiber->until = clock_;
      broken = true;
    }
    if (!broken) std::abort();
  }

  void switch_to(std::size_t next) {
    const std::size_t before = std::exchange(running_, next);
    if (before != next) swapcontext(&fibers_[before]->context, &fibers_[next]->context);
  }

  static constexpr std::size_t kMostThreads = 16, kTimePasses = kMostThreads;
  static inline World* current_world = nullptr;
  Choices& choices_;
  std::vector<std::unique_ptr<Fiber>> fibers_;
  std::size_t running_ = 0;
  Time clock_{}, believed_{};
  const std::size_t lost_;
  std::size_t notifications_ = 0;
};

/// The Sync parameter of BasicExecutor.
struct ControlledSync {
  struct Mutex {
    void lock() {
      World::current().wait([this] { return !held; });
      held = true;
    }
    void unlock() { held = false; }
    bool held = false;
  };
  struct Parker {
    [[nodiscard]] std::uint32_t ticket() const { return tickets; }
    void park_until(std::uint32_t ticket, Time until) {
      World& world = World::current();
      const std::uint32_t from = world.fault == Fault::ticket_ignored ? (world.step(), tickets) : ticket;
      const auto woken = [this, from] { return tickets != from; };
      world.wait(woken, until, true);
      if (world.fault == Fault::early_is_due && !woken()) world.believe(until);
    }
    void unpark() {
      World::current().step();
      if (World::current().notify()) ++tickets;
    }
    std::uint32_t tickets = 0;
  };
  struct Thread {
    Thread() = default;
    explicit Thread(std::function<void()> body) : fiber(World::current().start(std::move(body))) {}
    [[nodiscard]] bool joinable() const { return fiber != 0; }
    void join() {
      World::current().wait([this] { return World::current().ended(fiber); });
      fiber = 0;
    }
    std::size_t fiber = 0;
  };
  struct Latch {
    explicit Latch(std::ptrdiff_t count) : left(count) {}
    void count_down() { --left; }
    void wait() {
      World::current().wait([this] { return left == 0; });
    }
    std::ptrdiff_t left;
  };
  static Time now() { return World::current().now(); }
  static ThreadPolicy prepare_thread(WorkerRole, const ThreadPolicyRequest&) { return {}; }
};

}  // namespace hotpath::test
