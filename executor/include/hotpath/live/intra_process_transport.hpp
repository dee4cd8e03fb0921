// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cassert>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "hotpath/live/transport.hpp"

namespace hotpath {

/// Synchronous zero-copy transport within one process: the paper's zero-delay case. A message
/// occupies a block that all its readers share; the last reader returns the block to the pool.
template <class Message>
class IntraProcessTransport final : public Transport<Message>, private SampleOwner {
 public:
  using typename Transport<Message>::WriterId;

  explicit IntraProcessTransport(PrepareMessage<Message> prepare = [](Message&) {})
      : prepare_(std::move(prepare)) {}

  WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t) override {
    writers_.push_back(&topics_[topic]);
    grow(depth + 1);
    return static_cast<WriterId>(writers_.size() - 1);
  }

  void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t,
                  SampleSink& sink) override {
    topics_[topic].push_back({task, &sink});
    grow(depth + 2);  // unread, held by a job, and in the slot of a fusion or cyclic node
  }

  void wait_until_matched(Time) override {}

  Message& borrow(WriterId) override {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) add_block();
    Block* block = free_.back();
    free_.pop_back();
    return block->message;
  }

  void publish(WriterId writer, Message& message, const SampleInfo& info) override {
    // The message is the first member of its block.
    Block* block = reinterpret_cast<Block*>(&message);
    const std::vector<Reader>& readers = *writers_[writer];
    block->users.store(static_cast<std::uint32_t>(readers.size()) + 1, std::memory_order_relaxed);
    for (const Reader& r : readers) {
      r.sink->deliver(r.task, info, Sample(&block->message, *this, reinterpret_cast<std::uintptr_t>(block)));
    }
    release(block);
  }

 private:
  struct Block {
    Message message;
    std::atomic<std::uint32_t> users{0};
  };
  struct Reader {
    TaskId task;
    SampleSink* sink;
  };

  void give_back(const void*, std::uintptr_t token) noexcept override {
    release(reinterpret_cast<Block*>(token));
  }

  void lend_again(std::uintptr_t token) noexcept override {
    reinterpret_cast<Block*>(token)->users.fetch_add(1, std::memory_order_relaxed);
  }

  void release(Block* block) noexcept {
    if (block->users.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    const std::lock_guard lock(mutex_);
    free_.push_back(block);  // no allocation: add_block() reserved the capacity
  }

  void add_block() {
    Block& block = blocks_.emplace_back();
    static_assert(offsetof(Block, message) == 0);
    prepare_(block.message);
    free_.reserve(blocks_.size());
    free_.push_back(&block);
  }

  void grow(std::uint32_t blocks) {
    const std::lock_guard lock(mutex_);
    for (std::uint32_t i = 0; i < blocks; ++i) add_block();
  }

  const PrepareMessage<Message> prepare_;
  std::unordered_map<std::string, std::vector<Reader>> topics_;  // pointers to elements stay valid
  std::vector<const std::vector<Reader>*> writers_;
  std::mutex mutex_;
  std::deque<Block> blocks_;
  std::vector<Block*> free_;
};

}  // namespace hotpath
