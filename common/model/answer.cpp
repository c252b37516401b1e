#include "common/model/answer.hpp"

namespace sls::model {

const char* to_string(ErrorCode error_code) {
  switch (error_code) {
    case ErrorCode::kNone:
      return "none";
    case ErrorCode::kFreeFall:
      return "free_fall";
    case ErrorCode::kRodLevel:
      return "rod_level";
    case ErrorCode::kNotFinite:
      return "not_finite";
    case ErrorCode::kStageTimeout:
      return "stage_timeout";
  }
  return "unknown";
}

}  // namespace sls::model
