#include "rigid_motion.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "sidestep/math/rotation.hpp"

namespace sidestep {
namespace {

constexpr double on_a_line = 1e-6;     // Ratio of singular values below which points are on a line.
constexpr double at_one_place = 1e-9;  // Radius of gyration below which points do not turn [m].

/// The rotation that takes points nearest to others, both about their means.
Eigen::Matrix3d rotation_between(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Matrix3d correlation = to * from.transpose();
  const Eigen::Vector3d values = Eigen::JacobiSVD<Eigen::Matrix3d>(correlation).singularValues();
  if (values[1] <= on_a_line * values[0]) {
    Eigen::Index farthest = 0;
    from.colwise().squaredNorm().maxCoeff(&farthest);
    return Eigen::Quaterniond::FromTwoVectors(from.col(farthest), to.col(farthest)).toRotationMatrix();
  }
  return nearest_rotation(correlation);
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
    matrix = rotation_between(arms, turned);
    const Eigen::AngleAxisd turn(matrix);
    rotation = turn.angle() * turn.axis();
  }
  residual = (matrix * arms - turned).colwise().norm();
}

}  // namespace sidestep
