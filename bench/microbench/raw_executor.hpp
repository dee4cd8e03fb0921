// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "hotpath/fastdds/participant.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/thread_setup.hpp"

namespace hotpath::microbench {

/// Borrows an uninitialised message from `writer`. Throws std::runtime_error if there is none.
inline void* borrow_raw(eprosima::fastdds::dds::DataWriter& writer) {
  void* message = nullptr;
  writer.loan_sample(message,
                     eprosima::fastdds::dds::DataWriter::LoanInitializationKind::NO_LOAN_INITIALIZATION);
  if (message == nullptr) throw std::runtime_error("Fast DDS lent no sample");
  return message;
}

/// The yardstick of executor and transport: Fast DDS with loaned samples and the threads of a live
/// executor. A listener passes each sample to one thread, which handles samples and timers in
/// order. FastDdsParticipant sets up participant and endpoints, so that all settings are the same.
template <class Message>
class RawExecutor {
 public:
  using OnSample = std::function<void(const Message&)>;

  ~RawExecutor() { stop(); }

  void add_reader(FastDdsParticipant& participant, const std::string& topic, std::uint32_t depth,
                  std::uint32_t writers, OnSample on_sample) {
    Reader& reader = readers_.emplace_back();
    reader.executor = this;
    reader.on_sample = std::move(on_sample);
    reader.loans.resize(depth + 2);
    for (Loan& loan : reader.loans) {
      loan.reader = &reader;
      reader.free.push_back(&loan);
    }
    reader.endpoint = participant.add_reader(topic, depth, writers, &reader);
  }

  void add_timer(Time first, Duration period, std::function<void()> on_time) {
    timers_.push_back({first, period, std::move(on_time)});
  }

  void start() {
    thread_ = std::thread([this] { work(); });
  }

  void stop() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    arrived_.notify_one();
    thread_.join();
  }

 private:
  struct Reader;
  struct Loan {
    eprosima::fastdds::dds::LoanableSequence<Message> data;
    eprosima::fastdds::dds::SampleInfoSeq infos;
    Reader* reader = nullptr;
  };
  struct Reader final : eprosima::fastdds::dds::DataReaderListener {
    void on_data_available(eprosima::fastdds::dds::DataReader* reader) override {
      Loan* loan = nullptr;
      {
        const std::lock_guard lock(executor->mutex_);
        if (free.empty()) return;  // the thread is far behind; a later call takes the sample
        loan = free.back();
        free.pop_back();
      }
      const bool taken =
          reader->take(loan->data, loan->infos) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
      bool sleeper = false;
      {
        const std::lock_guard lock(executor->mutex_);
        if (taken) {
          executor->queue_.push_back(loan);
        } else {
          free.push_back(loan);
        }
        sleeper = taken && std::exchange(executor->sleeping_, false);
      }
      if (sleeper) executor->arrived_.notify_one();
    }
    RawExecutor* executor = nullptr;
    OnSample on_sample;
    eprosima::fastdds::dds::DataReader* endpoint = nullptr;
    std::deque<Loan> loans;
    std::vector<Loan*> free;
  };
  struct Timer {
    Time next;
    Duration period;
    std::function<void()> on_time;
  };

  void work() {
    minimise_timer_slack();
    std::unique_lock lock(mutex_);
    while (!stop_) {
      lock.unlock();
      const Time wake_at = run_due_timers();
      lock.lock();
      if (queue_.empty()) {
        sleeping_ = true;
        arrived_.wait_until(lock, wake_at);
        sleeping_ = false;
        continue;
      }
      Loan* loan = queue_.front();
      queue_.pop_front();
      lock.unlock();
      handle(*loan);
      lock.lock();
      loan->reader->free.push_back(loan);
    }
  }

  /// Returns the instant at which the next timer is due.
  Time run_due_timers() {
    Time next = Time::max();
    if (timers_.empty()) return next;
    const Time now = hotpath::now();
    for (Timer& timer : timers_) {
      if (timer.next <= now) {
        timer.on_time();
        timer.next += timer.period;
      }
      next = std::min(next, timer.next);
    }
    return next;
  }

  void handle(Loan& loan) {
    for (std::int32_t i = 0; i < loan.infos.length(); ++i) {
      if (loan.infos[i].valid_data) loan.reader->on_sample(loan.data[i]);
    }
    loan.reader->endpoint->return_loan(loan.data, loan.infos);
  }

  std::deque<Reader> readers_;
  std::vector<Timer> timers_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Loan*> queue_;
  bool sleeping_ = false, stop_ = false;
  std::thread thread_;
};

}  // namespace hotpath::microbench
