// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "program/text_table.hpp"
#include "watch/contract.hpp"
#include "watch/session.hpp"

namespace hotpath::watch {

/// Compares the jobs of a running system with a contract.
class ContractCheck {
 public:
  /// `begin`: the instant from which incidents count.
  ContractCheck(Contract contract, Time begin);

  /// A job that ended, in the order of ends; `timestamp`: where it is known.
  void job(const tracing::System& system, const tracing::Job& job, std::optional<Time> timestamp);

  /// Whether any term is broken.
  [[nodiscard]] bool broken() const { return cause_.has_value() || excess_.has_value(); }
  /// The first broken assumption and the first exceeded bound, in one sentence; empty if there is
  /// none of both.
  [[nodiscard]] std::string incident() const;
  /// Lost events make terms that are not broken unobservable.
  [[nodiscard]] program::TextTable table(const Losses& losses) const;
  [[nodiscard]] nlohmann::json json(const Losses& losses) const;

 private:
  struct Breach {
    Time at{};
    std::string sentence;
  };
  struct TermState {
    Term term;
    std::uint64_t checked = 0, broken = 0;
    std::optional<Breach> first = {};
  };
  struct CallbackState {
    std::vector<TermState> terms;
    bool seen = false;
    std::optional<tracing::Sample> previous = {};  ///< Its latest sample.
  };
  struct Verdict {
    const char* word;  ///< held, broken, not observable
    std::string reason;
  };

  /// Index of the contract's entry for a callback of the system; kNone: none.
  std::uint32_t entry_of(const tracing::System& system, std::uint32_t callback);
  [[nodiscard]] std::uint32_t find_entry(const tracing::System& system, std::uint32_t callback) const;
  void check(CallbackState& state, std::uint32_t entry, TermState& term, const tracing::Callback& callback,
             const tracing::Job& job, std::optional<Time> timestamp);
  void compare(std::uint32_t entry, TermState& term, std::int64_t observed, bool holds, Time at);
  [[nodiscard]] Verdict verdict(const CallbackState& state, const TermState& term,
                                const Losses& losses) const;
  [[nodiscard]] double seconds(Time at) const { return to_ms(at - begin_) / 1000; }

  const Contract contract_;
  const Time begin_;
  std::vector<CallbackState> states_;     // parallel to the contract's callbacks
  std::vector<std::uint32_t> entries_;    // by callback of the system
  std::optional<Breach> cause_, excess_;  // the first broken assumption, and exceeded bound
};

}  // namespace hotpath::watch
