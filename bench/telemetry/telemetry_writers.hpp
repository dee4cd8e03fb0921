// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <cstdint>

#include "hotpath/fastdds/participant.hpp"

namespace hotpath::telemetry {

/// A separate participant that publishes the types of reference_system/idl/Telemetry.idl in the
/// default partition. Publications do not wait for readers. The destructor deletes all DDS
/// entities.
class Writers {
 public:
  /// Ignores partition and topic prefix of `options`. Throws TransportError.
  explicit Writers(const FastDdsOptions& options);
  ~Writers();
  Writers(const Writers&) = delete;
  Writers& operator=(const Writers&) = delete;

  void publish(telemetry::RunInfo info);
  void publish(telemetry::ChainSample sample);
  void publish(telemetry::Statistics statistics);  ///< Fills in `samples_lost`.
  void publish(telemetry::Clock clock);

  /// Upper bound on the chain samples that did not reach every reader. Fast DDS does not report
  /// samples dropped from a full history, so every sample counts as unread until all readers have
  /// acknowledged all samples.
  std::uint64_t samples_lost() const { return samples_lost_; }

  /// Waits at most `limit` until a reader of chain samples is matched.
  void await_reader(Duration limit) const;
  /// Waits at most `limit` until every reader has acknowledged all publications.
  void flush(Duration limit) const;

 private:
  void note_acknowledged();

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::DataWriter *run_ = nullptr, *statistics_ = nullptr, *chain_samples_ = nullptr,
                                     *clock_ = nullptr;
  std::uint64_t samples_written_ = 0, samples_acknowledged_ = 0, samples_lost_ = 0;
};

}  // namespace hotpath::telemetry
