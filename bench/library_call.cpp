// Cost of a call of a controller in a shared library: the same trivial law, built in and as a C
// library.
#include <benchmark/benchmark.h>

#include "control_client/laws/control_law.hpp"

namespace sls::bench {
namespace {

/// hover_law.c in C++.
class HoverLaw : public control::ControlLaw {
 public:
  explicit HoverLaw(const model::SlungLoadParameters& vehicle)
      : weight_(vehicle.total_mass() * vehicle.gravity) {}
  control::LawOutput calc(const control::LawInput& input) const override {
    return {{0.0, 0.0, -weight_}, input.memory, control::ErrorCode::kNone};
  }
  int memory_size() const override { return 3; }

 private:
  double weight_;  // N
};

void call_law(benchmark::State& run, const control::ControlLaw& law) {
  control::LawInput input;
  input.memory.setZero(law.memory_size());
  for (auto _ : run) {
    control::LawOutput output = law.calc(input);
    input.memory = output.memory;
    ++input.step;
    benchmark::DoNotOptimize(output);
  }
}

void built_in_law(benchmark::State& run) { call_law(run, HoverLaw(model::SlungLoadParameters{})); }
BENCHMARK(built_in_law);

void library_law(benchmark::State& run) {
  control::LawSetup setup;
  setup.controller.law.name = SLS_HOVER_LAW;
  call_law(run, *control::make_control_law(setup));
}
BENCHMARK(library_law);

}  // namespace
}  // namespace sls::bench
