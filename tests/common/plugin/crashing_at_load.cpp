#include "tests/common/plugin/misbehaviour.hpp"

namespace {
const int kNothing = (sls::test::misbehave("crash"), 0);
}
