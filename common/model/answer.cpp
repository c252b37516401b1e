#include "common/model/answer.hpp"

namespace sls::model {

const char* to_string(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kFreeFall:
      return "free_fall";
    case Fault::kRodLevel:
      return "rod_level";
    case Fault::kNotFinite:
      return "not_finite";
    case Fault::kStageTimeout:
      return "stage_timeout";
  }
  return "unknown";
}

}  // namespace sls::model
