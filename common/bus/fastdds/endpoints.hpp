/// Avoids a defect of Fast DDS when a writer is deleted.
#pragma once

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>

#include <cstddef>

#include "fastdds_api.hpp"

namespace sls::bus {

/// Deletes a writer of `publisher` after its history: otherwise a heartbeat to a dead reader may
/// find a half-deleted history and loop for ever (README.md, trap 13). Upstream: none reported. To
/// be deleted when deleting a writer waits for its heartbeat.
inline void delete_writer(dds::Publisher& publisher, dds::DataWriter* writer) {
  writer->set_listener(nullptr);
  std::size_t removed = 0;
  writer->clear_history(&removed);
  publisher.delete_datawriter(writer);
}

}  // namespace sls::bus
