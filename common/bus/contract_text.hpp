#pragma once

#include <string_view>

namespace sls::bus {

/// The text of idl/sls.idl at build time: the schema of MCAP and Foxglove channels.
extern const std::string_view kContractText;

}  // namespace sls::bus
