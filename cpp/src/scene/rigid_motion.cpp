#include "rigid_motion.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace sidestep {
namespace {

constexpr double on_a_line = 1e-6;     // Ratio of singular values below which points are on a line.
constexpr double at_one_place = 1e-9;  // Radius of gyration below which points do not turn [m].

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(to * from.transpose(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d values = svd.singularValues();
  if (values[1] <= on_a_line * values[0]) {
    Eigen::Index farthest = 0;
    from.colwise().squaredNorm().maxCoeff(&farthest);
    return Eigen::Quaterniond::FromTwoVectors(from.col(farthest), to.col(farthest)).toRotationMatrix();
  }
  const bool is_mirrored = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0;
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, is_mirrored ? -1.0 : 1.0).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

RigidMotion::RigidMotion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d before = from.rowwise().mean(), now = to.rowwise().mean();
  const Eigen::Matrix3Xd arms = from.colwise() - before, turned = to.colwise() - now;
  translation = now - before;
  gyration = std::sqrt(turned.squaredNorm() / static_cast<double>(to.cols()));
  rotation.setZero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  if (gyration > at_one_place && arms.squaredNorm() > 0.0) {
    matrix = nearest_rotation(arms, turned);
    const Eigen::AngleAxisd turn(matrix);
    rotation = turn.angle() * turn.axis();
  }
  residual = (matrix * arms - turned).colwise().norm();
}

}  // namespace sidestep
