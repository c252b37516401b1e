// Our own elementary functions beside those of this C library, over the arguments of a flight.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <random>

#include "common/model/math.hpp"

namespace sls::bench {
namespace {

constexpr std::size_t kNumbers = 4096;  // few enough for the cache, too many for a branch predictor

/// Calls `function` with two numbers of [low, high] that differ each time.
template <class Function>
void call(benchmark::State& run, double low, double high, const Function& function) {
  std::mt19937_64 generator(1);
  std::array<double, kNumbers> numbers;
  for (double& number : numbers)
    number = low + (high - low) * static_cast<double>(generator() >> 11) * 0x1p-53;
  std::size_t i = 0;
  for (auto _ : run) {
    benchmark::DoNotOptimize(function(numbers[i % kNumbers], numbers[(i + 1) % kNumbers]));
    ++i;
  }
}

#define SLS_COMPARE(name, low, high, expression_of_math, expression_of_std)                        \
  void name##_own(benchmark::State& run) {                                                         \
    call(run, low, high,                                                                           \
         []([[maybe_unused]] double x, [[maybe_unused]] double y) { return expression_of_math; }); \
  }                                                                                                \
  void name##_libm(benchmark::State& run) {                                                        \
    call(run, low, high,                                                                           \
         []([[maybe_unused]] double x, [[maybe_unused]] double y) { return expression_of_std; });  \
  }                                                                                                \
  BENCHMARK(name##_own);                                                                           \
  BENCHMARK(name##_libm)

SLS_COMPARE(sin, -20.0, 20.0, math::sin(x), std::sin(x));
SLS_COMPARE(sin_below_quarter_turn, -0.7, 0.7, math::sin(x), std::sin(x));
SLS_COMPARE(sin_of_huge, 1e15, 1e16, math::sin(x), std::sin(x));
SLS_COMPARE(cos, -20.0, 20.0, math::cos(x), std::cos(x));
SLS_COMPARE(cos_below_quarter_turn, -0.7, 0.7, math::cos(x), std::cos(x));
SLS_COMPARE(exp, -5.0, 5.0, math::exp(x), std::exp(x));
SLS_COMPARE(log, 0.01, 5.0, math::log(x), std::log(x));
SLS_COMPARE(atan2, -1.0, 1.0, math::atan2(y, x), std::atan2(y, x));
SLS_COMPARE(tan, -1.5, 1.5, math::tan(x), std::tan(x));

#undef SLS_COMPARE

}  // namespace
}  // namespace sls::bench
