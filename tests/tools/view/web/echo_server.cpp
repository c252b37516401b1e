/// A server for clients of other projects: the page, and protocols that echo. Prints its port; ends
/// at the end of its standard input.
#include <cstdio>
#include <iostream>

#include "tests/tools/view/web/running_server.hpp"
#include "tests/tools/view/web/sessions.hpp"

int main() {
  using namespace sls;
  test::RunningServer server(test::make_options(), test::add_echo_and_page);
  std::printf("%d\n", static_cast<int>(server.port()));
  std::fflush(stdout);
  while (std::cin.get() != std::char_traits<char>::eof()) {
  }
  return 0;
}
