/// The page's bytes, made by build.mjs at build time.
#pragma once

#include <string_view>

namespace sls::view {

/// One self-contained HTML file, compressed with gzip; it lives as long as the program.
std::string_view page_html_gz();

}  // namespace sls::view
