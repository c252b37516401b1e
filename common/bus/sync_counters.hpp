/// A table of the server's counters. The code that adds, records and shows counters uses it.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "sls.h"

namespace sls::bus {

struct SyncCounter {
  const char* name;  ///< of the field in sls.idl and of the column in status.csv
  std::uint64_t (SyncCounters::*get)() const;
  std::uint64_t& (SyncCounters::*change)();
};

/// In the order of status.csv.
#define SLS_COUNTER(name) \
  SyncCounter { #name, &SyncCounters::name, &SyncCounters::name }
inline constexpr std::array kSyncCounters = {SLS_COUNTER(resent),
                                             SLS_COUNTER(late),
                                             SLS_COUNTER(duplicate),
                                             SLS_COUNTER(superseded),
                                             SLS_COUNTER(take_overs),
                                             SLS_COUNTER(rejected_not_finite),
                                             SLS_COUNTER(rejected_force_limit),
                                             SLS_COUNTER(rejected_run),
                                             SLS_COUNTER(rejected_step),
                                             SLS_COUNTER(rejected_vehicle),
                                             SLS_COUNTER(rejected_client),
                                             SLS_COUNTER(rejected_fault),
                                             SLS_COUNTER(stale),
                                             SLS_COUNTER(held),
                                             SLS_COUNTER(fail_safe),
                                             SLS_COUNTER(deadline_missed),
                                             SLS_COUNTER(overflow),
                                             SLS_COUNTER(slipped)};
#undef SLS_COUNTER

inline void add(SyncCounters& sum, const SyncCounters& counters) {
  for (const SyncCounter& counter : kSyncCounters)
    (sum.*counter.change)() += (counters.*counter.get)();
}

struct Count {
  const char* words;  ///< such as "fail-safe"
  std::uint64_t value;
};

/// The counters for a text, in the order of `words`. The name of a counter is `prefix` and one of
/// `words`, with an underscore for each space and hyphen.
/// @throws std::logic_error if there is no counter of that name.
std::vector<Count> list_counts(const SyncCounters& counters, const std::string& prefix,
                               std::initializer_list<const char*> words);

/// "fail-safe" → "fail_safe".
std::string to_counter_name(std::string words);

}  // namespace sls::bus
