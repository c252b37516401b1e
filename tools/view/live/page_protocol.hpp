/// Sessions of the page: subprotocol "sls.view.1". Messages: tools/view/README.md.
#pragma once

#include <cstdint>

#include "tools/view/live/feed.hpp"
#include "tools/view/live/operator.hpp"
#include "tools/view/web/connection.hpp"

namespace sls::view {

inline constexpr const char* kPageProtocol = "sls.view.1";

/// The viewer's settings, for the page.
struct PageOptions {
  int domain = 0;
  std::uint32_t vehicle_id = 0;
  bool takes_token = false;  ///< a page without a token may ask its user for one
};

/// Feed and operator must outlive the sessions.
Protocol make_page_protocol(Feed& feed, Operator& requests, const PageOptions& options = {});

}  // namespace sls::view
