#pragma once

#include <string_view>
#include <vector>

#include "common/bus/topics.hpp"
#include "recorder/rows.hpp"

namespace sls::record {

/// Makes of a step's rows a `RecordEntry` as CDR, little-endian, with its encapsulation header.
/// Fields that no row holds stay empty: README.md lists them.
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
