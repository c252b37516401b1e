/// Writes serialised samples on any topic, for types that are not in sls.idl, such as those of
/// ROS 2.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "common/bus/node.hpp"

namespace sls::bus {

struct RawTopic {
  std::string name;       ///< "rt/tf"
  std::string type;       ///< as readers must name it: "tf2_msgs::msg::dds_::TFMessage_"
  std::string user_data;  ///< policy USER_DATA of the writer; may be empty
};

/// Readers must have the same type name, and no key.
class RawWriter {
 public:
  static constexpr std::size_t kMostBytes = 64'000;  ///< of a sample

  /// `profile`: one of the QoS file.
  RawWriter(Node& node, const RawTopic& topic, const char* profile);

  /// `cdr`: plain CDR, little-endian, with its encapsulation header. As with Writer::write, a
  /// reader's handler must not call it.
  /// @throws BusError if `cdr` is longer than `kMostBytes`, or if the history stayed full.
  void write(const std::vector<std::uint8_t>& cdr);

  /// Participants with a reader that is matched with this writer.
  std::set<PeerId> matched() const { return writer_.matched(); }

 private:
  std::string topic_;
  detail::AnyWriter writer_;
};

}  // namespace sls::bus
