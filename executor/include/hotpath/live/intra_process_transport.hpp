// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cassert>
#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "hotpath/live/pool.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath {

/// Synchronous zero-copy transport within one process: the paper's zero-delay case. A message
/// occupies a block that all its readers share; the last reader returns the block to the pool.
template <class Message>
class IntraProcessTransport final : public Transport<Message>, private SampleOwner {
 public:
  using typename Transport<Message>::WriterId;

  explicit IntraProcessTransport(PrepareMessage<Message> prepare = [](Message&) {})
      : blocks_([prepare = std::move(prepare)](Block& block) { prepare(block.message); }) {}

  WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t) override {
    writers_.push_back(&topics_[topic]);
    blocks_.grow(depth + 1);
    return static_cast<WriterId>(writers_.size() - 1);
  }

  void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t,
                  SampleSink& sink) override {
    topics_[topic].push_back({task, &sink});
    blocks_.grow(depth + 2);  // unread, held by a job, and in the slot of a fusion or cyclic node
  }

  void wait_until_matched(Time) override {}

  Message& borrow(WriterId) override { return blocks_.take().message; }

  void publish(WriterId writer, Message& message, const SampleInfo& info) override {
    // The message is the first member of its block.
    static_assert(offsetof(Block, message) == 0);
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
    if (block->users.fetch_sub(1, std::memory_order_acq_rel) == 1) blocks_.put_back(*block);
  }

  std::unordered_map<std::string, std::vector<Reader>> topics_;  // pointers to elements stay valid
  std::vector<const std::vector<Reader>*> writers_;
  Pool<Block> blocks_;
};

}  // namespace hotpath
