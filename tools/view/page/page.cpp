#include "tools/view/page/page.hpp"

#include <cstddef>

// SLS_PAGE_FILE: page.html.gz in the build tree.
asm(".section .rodata\n"
    ".global sls_view_page_begin\n"
    ".global sls_view_page_end\n"
    "sls_view_page_begin:\n"
    ".incbin \"" SLS_PAGE_FILE
    "\"\n"
    "sls_view_page_end:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" {
extern const char sls_view_page_begin;
extern const char sls_view_page_end;
}

namespace sls::view {

std::string_view page_html_gz() {
  return {&sls_view_page_begin,
          static_cast<std::size_t>(&sls_view_page_end - &sls_view_page_begin)};
}

}  // namespace sls::view
