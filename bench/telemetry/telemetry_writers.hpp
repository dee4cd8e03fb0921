// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Telemetry.h>

#include <cstdint>

#include "hotpath/fastdds/participant.hpp"

namespace hotpath {

/// A separate participant that publishes what reference_system/idl/Telemetry.idl describes, in the default
/// partition. No publication waits for a reader. Its destruction removes all that Fast DDS created.
class TelemetryWriters {
 public:
  /// Partition and topic prefix of `options` are not used. Throws TransportError.
  explicit TelemetryWriters(const FastDdsOptions& options);
  ~TelemetryWriters();
  TelemetryWriters(const TelemetryWriters&) = delete;
  TelemetryWriters& operator=(const TelemetryWriters&) = delete;

  void publish(telemetry::RunInfo info);
  void publish(telemetry::ChainSample sample);
  void publish(telemetry::Statistics statistics);  ///< Fills in `samples_lost`.
  void publish(telemetry::Clock clock);

  /// Chain samples that may not have reached every reader. Fast DDS does not say what leaves a full history,
  /// so that this takes every sample as unread until all readers have acknowledged all: it never says too
  /// little.
  std::uint64_t samples_lost() const { return samples_lost_; }

  /// Waits until a reader of chain samples is there, or until `limit` has passed.
  void await_reader(Duration limit) const;
  /// Waits until every reader has what was published, or until `limit` has passed.
  void flush(Duration limit) const;

 private:
  void note_acknowledged();

  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::DataWriter *run_ = nullptr, *statistics_ = nullptr, *chain_samples_ = nullptr,
                                     *clock_ = nullptr;
  std::uint64_t samples_written_ = 0, samples_acknowledged_ = 0, samples_lost_ = 0;
};

}  // namespace hotpath
