#include "sidestep/math/rotation.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <sstream>
#include <stdexcept>

namespace sidestep {

double rotation_defect(const Eigen::Matrix3d& matrix) noexcept {
  return (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

void check_rotation(const Eigen::Matrix3d& R, const std::string& owner) {
  if (R.allFinite() && R.determinant() < 0.0) {
    throw std::invalid_argument(owner + ": the upper left 3 × 3 block of the pose mirrors, so it is not a rotation");
  }
  if (const double off = rotation_defect(R); R.allFinite() && !(off < rotation_tolerance)) {
    std::ostringstream text;
    text.precision(2);
    text << owner << ": the upper left 3 × 3 block R of the pose is not a rotation: an entry of R^T R - 1 is " << off
         << ", allowed are " << rotation_tolerance << " and, of what was rounded, " << rotation_rounding
         << " by way of nearest_rotation(R); a quaternion must have norm 1";
    throw std::invalid_argument(text.str());
  }
}

}  // namespace sidestep
