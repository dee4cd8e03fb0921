// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "hotpath/fastdds/participant.hpp"

namespace hotpath::gbench {

/// The yardstick of a transport: Fast DDS with loaned samples and the threads of a live executor, a listener
/// that hands each sample over to one thread that takes them in order, and nothing else. (Participant and
/// endpoints are set up by FastDdsParticipant, so that all settings are the same.)
template <class Traits>
class RawTaker {
 public:
  using Message = typename Traits::Message;

  explicit RawTaker(std::size_t samples) { latencies_.reserve(samples); }
  ~RawTaker() {
    if (thread_.joinable()) stop();
  }

  void add_reader(FastDdsParticipant& participant, const std::string& topic, std::uint32_t depth) {
    Reader& reader = readers_.emplace_back();
    reader.taker = this;
    reader.loans.resize(depth + 2);
    for (Loan& loan : reader.loans) {
      loan.reader = &reader;
      reader.free.push_back(&loan);
    }
    reader.endpoint = participant.add_reader(topic, depth, 1, &reader);
  }

  void start() {
    thread_ = std::thread([this] { take(); });
  }

  /// Publication to the taker's hands, in nanoseconds, of all samples so far.
  std::vector<double> stop() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    arrived_.notify_one();
    thread_.join();
    return latencies_;
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
      for (;;) {
        Loan* loan = nullptr;
        {
          const std::lock_guard lock(taker->mutex_);
          if (free.empty()) return;  // the taker is far behind: what it leaves is taken with the next sample
          loan = free.back();
          free.pop_back();
        }
        const bool taken =
            reader->take(loan->data, loan->infos, 1) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
        bool sleeper = false;
        {
          const std::lock_guard lock(taker->mutex_);
          if (taken) {
            taker->queue_.push_back(loan);
          } else {
            free.push_back(loan);
          }
          sleeper = taken && taker->sleeping_;
          if (sleeper) taker->sleeping_ = false;
        }
        if (sleeper) taker->arrived_.notify_one();
        if (!taken) return;
      }
    }
    RawTaker* taker = nullptr;
    eprosima::fastdds::dds::DataReader* endpoint = nullptr;
    std::deque<Loan> loans;
    std::vector<Loan*> free;
  };

  void take() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
      if (queue_.empty()) {
        sleeping_ = true;
        arrived_.wait(lock);
        continue;
      }
      Loan* loan = queue_.front();
      queue_.pop_front();
      lock.unlock();
      const Time start = std::chrono::steady_clock::now();
      if (loan->infos[0].valid_data && latencies_.size() < latencies_.capacity()) {
        latencies_.push_back(static_cast<double>((start - Traits::info(loan->data[0]).published).count()));
      }
      loan->reader->endpoint->return_loan(loan->data, loan->infos);
      lock.lock();
      loan->reader->free.push_back(loan);
    }
  }

  std::deque<Reader> readers_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Loan*> queue_;
  bool sleeping_ = false, stop_ = false;
  std::thread thread_;
  std::vector<double> latencies_;
};

}  // namespace hotpath::gbench
