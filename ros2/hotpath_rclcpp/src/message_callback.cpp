// SPDX-License-Identifier: Apache-2.0
#include "message_callback.hpp"

#include <rcl/subscription.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/live/pi_mutex.hpp"

namespace hotpath {

namespace {

/// The callbacks by number. call() takes no lock, because the middleware calls it for every sample;
/// a callback that is removed while it runs is freed when it has ended.
class Registry {
 public:
  std::uintptr_t add(MessageCallback::Callback callback) {
    const std::lock_guard lock(mutex_);
    std::size_t index = used_;
    if (!free_.empty()) {
      index = free_.back();
      free_.pop_back();
    } else if (++used_ > kSlots) {
      throw std::runtime_error("more than " + std::to_string(kSlots) +
                               " subscriptions are in executors of this process; use fewer");
    }
    std::atomic<Slot*>& chunk = chunks_[index / kChunk];
    if (chunk.load() == nullptr) chunk.store(new Slot[kChunk]);
    Slot& slot = chunk.load()[index % kChunk];
    slot.callback = std::move(callback);
    const std::uint64_t generation = slot.state.load() / kGeneration;
    slot.state.store(generation * kGeneration + kAlive);
    return static_cast<std::uintptr_t>(generation * kSlots + index);
  }

  void remove(std::uintptr_t number) {
    Slot& slot = slot_of(number);
    if (slot.state.fetch_sub(kAlive) % kAlive == 0) release(slot, number % kSlots);
  }

  void call(std::uintptr_t number, std::size_t count) {
    Slot& slot = slot_of(number);
    std::uint64_t state = slot.state.load();
    do {
      const bool same = state / kGeneration == number / kSlots;
      if (!same || state % kGeneration < kAlive) return;  // removed
    } while (!slot.state.compare_exchange_weak(state, state + 1));
    slot.callback(count);
    if ((slot.state.fetch_sub(1) - 1) % kGeneration == 0) release(slot, number % kSlots);
  }

 private:
  // A slot's state: its generation, whether it is alive, and the number of calls that are running.
  static constexpr std::uint64_t kAlive = std::uint64_t{1} << 16, kGeneration = 2 * kAlive;
  static constexpr std::size_t kChunk = 256, kSlots = 4096 * kChunk;
  /// So that slots and generations wrap together.
  static constexpr std::uint64_t kGenerations =
      std::min(std::uint64_t{UINTPTR_MAX} / kSlots, ~std::uint64_t{0} / kGeneration);

  struct alignas(64) Slot {
    std::atomic<std::uint64_t> state{kGeneration};
    MessageCallback::Callback callback;
  };

  Slot& slot_of(std::uintptr_t number) {
    const std::size_t index = number % kSlots;
    return chunks_[index / kChunk].load()[index % kChunk];
  }

  /// Nobody calls the slot any more.
  void release(Slot& slot, std::size_t index) {
    slot.callback = nullptr;
    const std::uint64_t next = slot.state.load() / kGeneration % kGenerations + 1;
    slot.state.store(next * kGeneration);
    const std::lock_guard lock(mutex_);
    free_.push_back(index);
  }

  std::array<std::atomic<Slot*>, kSlots / kChunk> chunks_{};  ///< Never freed.
  PiMutex mutex_;                                             ///< Guards what follows.
  std::size_t used_ = 0;
  std::vector<std::size_t> free_;
};

/// Never destroyed: the middleware's threads may outlive this library's static objects.
Registry& registry() {
  static Registry& instance = *new Registry;
  return instance;
}

void call(const void* number, std::size_t count) {
  registry().call(reinterpret_cast<std::uintptr_t>(number), count);
}

}  // namespace

MessageCallback::MessageCallback(const rclcpp::SubscriptionBase::SharedPtr& subscription, Callback callback)
    : number_(registry().add(std::move(callback))), handle_(subscription->get_subscription_handle()) {
  const rcl_ret_t ret = rcl_subscription_set_on_new_message_callback(
      subscription->get_subscription_handle().get(), call, reinterpret_cast<const void*>(number_));
  if (ret == RCL_RET_OK) return;
  registry().remove(number_);
  rclcpp::exceptions::throw_from_rcl_error(ret, "failed to set the callback for new messages");
}

MessageCallback::~MessageCallback() {
  const std::shared_ptr<rcl_subscription_t> handle = handle_.lock();
  if (handle && rcl_subscription_set_on_new_message_callback(handle.get(), nullptr, nullptr) != RCL_RET_OK) {
    rcl_reset_error();
  }
  registry().remove(number_);
}

}  // namespace hotpath
