/// Avoids two defects of Fast DDS 2.9 when a topic is created and when a writer is deleted.
#pragma once

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <cstddef>

namespace sls::bus {

/// Call it before the type is registered: a TypeObject on the wire crashes peers that do not know
/// the type (README.md, trap 1). Upstream: #3296. To be deleted with Fast DDS 3, which has other
/// TypeObjects, once a peer without the type survives.
inline void leave_out_type_object(eprosima::fastdds::dds::TypeSupport& type) {
  type->auto_fill_type_object(false);
  type->auto_fill_type_information(false);
}

/// Deletes a writer of `publisher` after its history: otherwise a heartbeat to a dead reader may
/// find a half-deleted history and loop for ever (README.md, trap 13). Upstream: none reported. To
/// be deleted when deleting a writer waits for its heartbeat.
inline void delete_writer(eprosima::fastdds::dds::Publisher& publisher,
                          eprosima::fastdds::dds::DataWriter* writer) {
  writer->set_listener(nullptr);
  std::size_t removed = 0;
  writer->clear_history(&removed);
  publisher.delete_datawriter(writer);
}

}  // namespace sls::bus
