/// Sessions of Foxglove, Lichtblick and other clients of the Foxglove WebSocket protocol.
/// Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
#pragma once

#include "tools/view/live/feed.hpp"
#include "tools/view/live/operator.hpp"
#include "tools/view/web/connection.hpp"

namespace sls::view {

/// Feed and operator must outlive the sessions.
Protocol make_foxglove_protocol(Feed& feed, Operator& requests);

}  // namespace sls::view
