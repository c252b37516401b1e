#include "sim_server/judgement.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace sls::sim {
namespace {

double calc_norm(const Eigen::Vector3d& f) { return std::hypot(f.x(), f.y(), f.z()); }

}  // namespace

std::optional<Defect> find_defect(const JudgedAnswer& answer, double force_limit) {
  if (!answer.f_Q_W.allFinite() || !answer.is_memory_finite) return Defect::kNotFinite;
  if (calc_norm(answer.f_Q_W) > force_limit) return Defect::kForceLimit;
  if (answer.fault || answer.is_mission_failed) return Defect::kFault;
  return std::nullopt;
}

const char* to_string(Defect defect) {
  switch (defect) {
    case Defect::kNotFinite:
      return "a number that is not finite";
    case Defect::kForceLimit:
      return "a force beyond controller.force_limit_n";
    case Defect::kFault:
      return "a fault";
  }
  return "";
}

std::string describe_refusal(Defect defect, const JudgedAnswer& answer, double force_limit,
                             const std::string& controller, std::uint64_t step) {
  std::string text =
      fmt::format("controller '{}' answered step {} with {}", controller, step, to_string(defect));
  if (defect == Defect::kForceLimit)
    text += fmt::format(": {:.6g} N > {:.6g} N", calc_norm(answer.f_Q_W), force_limit);
  if (defect == Defect::kFault)
    text += fmt::format(": {}", answer.fault ? answer.fault : "mission failed");
  return text;
}

}  // namespace sls::sim
