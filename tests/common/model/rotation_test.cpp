#include "common/model/rotation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace sls::model {
namespace {

using Eigen::Vector3d;

TEST(RotationTest, ATurnIsThatOfEigen) {
  for (double angle = -7.0; angle < 7.0; angle += 0.1)
    for (const Vector3d& axis :
         {Vector3d(Vector3d::UnitX()), Vector3d(Vector3d::UnitZ()), Vector3d(0.6, 0.0, -0.8)}) {
      const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
      // Both round a sine or cosine and a product.
      EXPECT_LT((make_turn(angle, axis).coeffs() - expected.coeffs()).norm(), 1e-15) << angle;
    }
}

}  // namespace
}  // namespace sls::model
