// A controller that hovers and misbehaves as `parameters` require:
//   { do: WHAT, in: create, answer or destroy, at: STEP, memory: COUNT }
// Macros change its table of functions into invalid ones, which must be refused.
#include <cstdio>
#include <memory>

#include "control_client/laws/shared_library/sls_controller.h"
#include "tests/common/plugin/misbehaviour.hpp"

#ifndef TEST_VERSION
#define TEST_VERSION SLS_CONTROLLER_VERSION
#endif
#ifndef TEST_TABLE_SIZE
#define TEST_TABLE_SIZE sizeof(sls_controller_functions)
#endif
#ifndef TEST_SETUP_SIZE
#define TEST_SETUP_SIZE sizeof(sls_controller_setup)
#endif
#ifndef TEST_INPUT_SIZE
#define TEST_INPUT_SIZE sizeof(sls_controller_input)
#endif
#ifndef TEST_OUTPUT_SIZE
#define TEST_OUTPUT_SIZE sizeof(sls_controller_output)
#endif
#ifndef TEST_ANSWER
#define TEST_ANSWER &answer
#endif
#ifndef TEST_REFUSES
#define TEST_REFUSES false
#endif
#ifndef TEST_RESULT
#define TEST_RESULT &functions
#endif

namespace {

using sls::test::find_parameter;

struct Controller {
  std::string what, where;
  std::uint64_t at = 0;
  std::uint32_t memory_count = 0;
  double weight_n = 0.0;
  int calls = 0;
};

void* create(const sls_controller_setup* setup, std::uint32_t* memory_count, char* error,
             std::size_t error_size) {
  if (TEST_REFUSES) return nullptr;
  const std::string parameters = setup->parameters;
  auto controller = std::make_unique<Controller>();
  controller->what = find_parameter(parameters, "do");
  controller->where = find_parameter(parameters, "in");
  controller->at = std::strtoull(find_parameter(parameters, "at").c_str(), nullptr, 10);
  controller->weight_n = (setup->quad_mass_kg + setup->load_mass_kg) * setup->gravity_m_s2;
  *memory_count = controller->memory_count = static_cast<std::uint32_t>(
      std::strtoul(find_parameter(parameters, "memory").c_str(), nullptr, 10));
  if (controller->where == "create") {
    sls::test::misbehave(controller->what);
    if (controller->what == "say the parameters")
      std::snprintf(error, error_size, "%s", setup->parameters);
    if (controller->what == "refuse")
      std::snprintf(error, error_size, "gain: expected > 0, got -1\nand a second line");
    if (controller->what == "say too much") std::string(error_size, 'x').copy(error, error_size);
    return nullptr;
  }
  return controller.release();
}

void destroy(void* controller) {
  const std::unique_ptr<Controller> self(static_cast<Controller*>(controller));
  if (self->where == "destroy") sls::test::misbehave(self->what);
}

[[maybe_unused]] int answer(void* controller, const sls_controller_input* input,
                            sls_controller_output* output, char* error, std::size_t error_size) {
  Controller& self = *static_cast<Controller*>(controller);
  ++self.calls;
  output->force_n[2] = -self.weight_n;
  for (std::uint32_t i = 0; i < self.memory_count; ++i) output->memory[i] = input->memory[i] + 1.0;
  if (self.where != "answer" || input->step < self.at) return SLS_CONTROLLER_OK;
  sls::test::misbehave(self.what);
  if (self.what == "force that is no number") output->force_n[1] = std::strtod("nan", nullptr);
  if (self.what == "infinite memory") output->memory[0] = std::strtod("inf", nullptr);
  if (self.what == "write beyond the memory") output->memory[self.memory_count] = 1.0;
  if (self.what == "remember") output->force_n[0] = 1e-9 * self.calls;
  if (self.what == "fault every other time")
    return self.calls % 2 == 0 ? SLS_CONTROLLER_FREE_FALL : SLS_CONTROLLER_OK;
  if (self.what == "free fall") return SLS_CONTROLLER_FREE_FALL;
  if (self.what == "level rod") return SLS_CONTROLLER_ROD_LEVEL;
  if (self.what == "not finite") return SLS_CONTROLLER_NOT_FINITE;
  if (self.what == "fail without a word") return SLS_CONTROLLER_ERROR;
  if (self.what == "return 17") return 17;
  if (self.what == "fail") {
    std::snprintf(error, error_size, "no solution after 20 iterations");
    return SLS_CONTROLLER_ERROR;
  }
  return SLS_CONTROLLER_OK;
}

}  // namespace

extern "C" const sls_controller_functions* sls_controller(void) {
  [[maybe_unused]] static const sls_controller_functions functions = {
      TEST_TABLE_SIZE,  TEST_VERSION, TEST_SETUP_SIZE, TEST_INPUT_SIZE,
      TEST_OUTPUT_SIZE, &create,      &destroy,        TEST_ANSWER};
  return TEST_RESULT;
}
