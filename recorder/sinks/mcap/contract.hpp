#pragma once

#include <string_view>

namespace sls::record {

/// The text of idl/sls.idl, as it was when this was built.
std::string_view contract_idl();

}  // namespace sls::record
