// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cassert>
#include <deque>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <vector>

#include "hotpath/fastdds/guarded_type.hpp"
#include "hotpath/fastdds/participant.hpp"
#include "hotpath/live/pool.hpp"
#include "hotpath/live/transport.hpp"

namespace hotpath {

/// eProsima Fast DDS with loaned samples on both sides. Fast DDS lends types of variable size only
/// to readers; for these the transport owns the written messages. `Traits` names the generated
/// type: `Message`, `PubSubType`, `static hotpath::SampleInfo info(const Message&)`, which reads
/// the information that the publisher wrote into the message, and `static bool valid(const
/// Message&, TaskId tasks)`, which returns whether a graph with so many tasks may publish the
/// message. Invalid samples and samples of unmatched writers are counted and dropped.
///
/// A reader's listener takes each arriving sample at once, as a loan without a copy, and passes it
/// to the sink, which only enqueues: the listener runs inside the publisher's write(), where a
/// nested publication would hang Fast DDS after a few hops.
template <class Traits>
class FastDdsTransport final : public Transport<typename Traits::Message>, private SampleOwner {
 public:
  using Message = typename Traits::Message;
  using typename Transport<Message>::WriterId;

  /// `tasks`: number of tasks of the graph.
  FastDdsTransport(
      const FastDdsOptions& options, TaskId tasks, PrepareMessage<Message> prepare = [](Message&) {})
      : tasks_(tasks), participant_(options), messages_(prepare) {
    const eprosima::fastdds::dds::TypeSupport type(new PreparedType(std::move(prepare)));
    loans_ = type->is_plain();
    participant_.register_type(type);
  }

  WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t readers) override {
    if (!loans_) messages_.grow(1);
    writers_.push_back(participant_.add_writer(topic, depth, readers));
    return static_cast<WriterId>(writers_.size() - 1);
  }

  void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t writers,
                  SampleSink& sink) override {
    Reader& reader = readers_.emplace_back(task, sink, *this);
    // Unread samples, one held by a job, one in a node's slot, and one arriving.
    reader.loans.grow(depth + 3);
    reader.endpoint = participant_.add_reader(topic, depth, writers, &reader);
  }

  void wait_until_matched(Time deadline) override { participant_.wait_until_matched(deadline); }

  Message& borrow(WriterId writer) override {
    if (!loans_) return messages_.take();
    using Initialization = eprosima::fastdds::dds::DataWriter::LoanInitializationKind;
    void* message = nullptr;
    [[maybe_unused]] const auto result =
        writers_[writer]->loan_sample(message, Initialization::NO_LOAN_INITIALIZATION);
    assert(message != nullptr && "every loan is published before the next is asked for");
    return *static_cast<Message*>(message);
  }

  void publish(WriterId writer, Message& message, const hotpath::SampleInfo&) override {
    [[maybe_unused]] const bool written = writers_[writer]->write(&message);
    assert(written && "a KEEP_LAST history always has room");
    if (!loans_) messages_.put_back(message);
  }

 private:
  struct Reader;

  /// Prepares the messages that Fast DDS creates to lend to readers.
  struct PreparedType final : GuardedType<typename Traits::PubSubType> {
    explicit PreparedType(PrepareMessage<Message> p) : prepare(std::move(p)) {}
    void* createData() override {
      void* const message = Traits::PubSubType::createData();
      prepare(*static_cast<Message*>(message));
      return message;
    }
    const PrepareMessage<Message> prepare;
  };

  /// The samples lent by one take(), nearly always one; Fast DDS requires both collections back.
  struct Loan {
    eprosima::fastdds::dds::LoanableSequence<Message> data;
    eprosima::fastdds::dds::SampleInfoSeq infos;
    std::atomic<std::int32_t> in_use{0};
    Reader* reader = nullptr;
  };

  struct Reader final : eprosima::fastdds::dds::DataReaderListener {
    Reader(TaskId t, SampleSink& s, FastDdsTransport& o)
        : task(t), sink(s), owner(o), loans([this](Loan& loan) { loan.reader = this; }) {}

    /// Takes all available samples at once: a later arrival calls again, and a second take() that
    /// finds nothing would cost nearly as much as the first.
    void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
      Loan& loan = loans.take();
      if (reader->take(loan.data, loan.infos) != eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
        return loans.put_back(loan);
      }
      const std::int32_t count = loan.infos.length();
      loan.in_use = count;
      for (std::int32_t i = 0; i < count; ++i) {
        if (!loan.infos[i].valid_data || !accepts(loan.infos[i], loan.data[i])) {
          release(loan);
          continue;
        }
        const Message& message = loan.data[i];
        sink.deliver(task, Traits::info(message),
                     Sample(&message, owner, reinterpret_cast<std::uintptr_t>(&loan)));
      }
    }

    bool accepts(const eprosima::fastdds::dds::SampleInfo& info, const Message& message) {
      const bool ours =
          owner.participant_.is_of_run(info.publication_handle) && Traits::valid(message, owner.tasks_);
      if (!ours) sink.rejected();
      return ours;
    }

    void release(Loan& loan) noexcept {
      if (--loan.in_use > 0) return;
      endpoint->return_loan(loan.data, loan.infos);
      loans.put_back(loan);
    }

    const TaskId task;
    SampleSink& sink;
    FastDdsTransport& owner;
    eprosima::fastdds::dds::DataReader* endpoint = nullptr;
    Pool<Loan> loans;
  };

  void give_back(const void*, std::uintptr_t token) noexcept override {
    Loan& loan = *reinterpret_cast<Loan*>(token);
    loan.reader->release(loan);
  }

  void lend_again(std::uintptr_t token) noexcept override { ++reinterpret_cast<Loan*>(token)->in_use; }

  const TaskId tasks_;
  // The readers must outlive the participant, which calls them.
  std::deque<Reader> readers_;
  FastDdsParticipant participant_;
  std::vector<eprosima::fastdds::dds::DataWriter*> writers_;

  bool loans_ = false;
  Pool<Message> messages_;  // used without loans
};

}  // namespace hotpath
