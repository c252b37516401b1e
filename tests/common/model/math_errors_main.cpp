/// Prints the greatest error of each function of common/model/math.hpp against MPFR.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/oracle/math_errors.hpp"

int main(int argc, char** argv) {
  std::int64_t arguments = 100'000;
  std::uint64_t seed = 1;
  CLI::App app("greatest errors of our sin, cos, exp, log, atan2, … against MPFR");
  app.add_option("--arguments", arguments, "arguments of each function")->capture_default_str();
  app.add_option("--seed", seed, "seed of the arguments")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  for (const auto& error : sls::test::find_greatest_errors(arguments, seed))
    std::printf("%-6s %.4f ulp at x = %.17g, y = %.17g\n", error.function.c_str(), error.ulps,
                error.x, error.y);
  return 0;
}
