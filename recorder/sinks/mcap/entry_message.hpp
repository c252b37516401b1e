#pragma once

#include <string_view>
#include <vector>

#include "common/bus/topics.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

/// Makes a `RecordEntry` from the rows of a step, as little-endian CDR with its encapsulation
/// header. Fields that are in no row stay empty: README.md lists them.
class EntryMessage {
 public:
  EntryMessage();

  /// Valid until the next call.
  std::string_view serialize(const StepRows& rows);

 private:
  void fill(const StepRows& rows);

  RecordEntry entry_;
  std::vector<char> bytes_;
};

}  // namespace sls::record
