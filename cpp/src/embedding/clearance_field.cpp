#include "sidestep/embedding/clearance_field.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "sidestep/embedding/boltzmann_mean.hpp"

namespace sidestep {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Stands for the centre of an ellipsoid, where h has no gradient [m]; far below any size that matters.
constexpr double centre_offset = 1e-9;

/// h of a point at offset e (principal axes), with what its derivatives need.
struct PointClearance {
  double value;
  Eigen::Vector3d gradient;  // ∂h/∂e

  /// Second time derivative of h along e' with e'' = 0, given the rate h'.
  double quadratic(const Eigen::Vector3d& e_dot, double rate, const Eigen::Vector3d& precisions) const noexcept;

  Eigen::Vector3d u;  // Σ⁻¹ e
  double root_m, norm_u, root_level;
};

PointClearance point_clearance(const Eigen::Vector3d& e, const Eigen::Vector3d& precisions,
                               double root_level) noexcept {
  // At the very centre the direction is undefined: take one of the steepest.
  PointClearance p;
  if (!(e.squaredNorm() > 0.0)) {
    Eigen::Index steepest;
    precisions.maxCoeff(&steepest);
    return point_clearance(centre_offset * Eigen::Vector3d::Unit(steepest), precisions, root_level);
  }
  p.u = precisions.cwiseProduct(e);
  p.root_m = std::sqrt(e.dot(p.u));
  p.norm_u = p.u.norm();
  p.root_level = root_level;
  const double numerator = p.root_m * (p.root_m - root_level);
  p.value = numerator / p.norm_u;
  // ∇(m − √c √m) = u (2 − √c/√m),  ∇|u| = Σ⁻¹ u / |u|.
  p.gradient = (p.u * (2.0 - root_level / p.root_m) - (p.value / p.norm_u) * precisions.cwiseProduct(p.u)) / p.norm_u;
  return p;
}

double PointClearance::quadratic(const Eigen::Vector3d& e_dot, double rate,
                                 const Eigen::Vector3d& precisions) const noexcept {
  const Eigen::Vector3d u_dot = precisions.cwiseProduct(e_dot);
  const double m_dot = 2.0 * u.dot(e_dot);
  const double m_ddot = 2.0 * e_dot.dot(u_dot);
  const double root_dot = m_dot / (2.0 * root_m);
  const double root_ddot = (m_ddot - 2.0 * root_dot * root_dot) / (2.0 * root_m);
  const double norm_dot = u.dot(u_dot) / norm_u;
  const double norm_ddot = (u_dot.squaredNorm() - norm_dot * norm_dot) / norm_u;
  // h |u| = m − √c √m, differentiated twice.
  return (m_ddot - root_level * root_ddot - 2.0 * rate * norm_dot - value * norm_ddot) / norm_u;
}

}  // namespace

ClearanceField::ClearanceField(const Robot& robot, const Body& body, double temperature)
    : temperature_(temperature) {
  if (!(temperature > 0.0) || temperature == infinity) {
    throw std::invalid_argument("clearance field: temperature is " + std::to_string(temperature) +
                                " m, must be positive and finite");
  }
  if (body.levels.size() == 0) {
    throw std::invalid_argument("clearance field: the body is not calibrated (it has no levels); use Body.cover");
  }
  for (int k = 0; k < body.num_components(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Frame& frame = robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[i]))];
    if (frame.joint < 0) {
      continue;
    }
    const Eigen::Matrix3d R = frame.X_JF.linear();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(R * body.covariances[i] * R.transpose());
    const Eigen::Vector3d semi_axes = (body.levels[k] * eigen.eigenvalues()).cwiseSqrt();
    ellipsoids_.push_back({frame.joint, k, frame.X_JF * body.means.col(k), eigen.eigenvectors().transpose(),
                           eigen.eigenvalues().cwiseInverse(), std::sqrt(body.levels[k]),
                           semi_axes.minCoeff() / semi_axes.maxCoeff(), semi_axes.maxCoeff()});
  }
  if (ellipsoids_.empty()) {
    throw std::invalid_argument("clearance field: no ellipsoid of the body lies on a link that a joint of robot '" +
                                robot.name() + "' moves");
  }
  std::stable_sort(ellipsoids_.begin(), ellipsoids_.end(),
                   [](const Ellipsoid& a, const Ellipsoid& b) { return a.joint < b.joint; });
}

void ClearanceField::evaluate(const KinematicState& state, const Obstacles& obstacles, double reach,
                              ClearanceView out) const noexcept {
  const double horizon = BoltzmannMean::window * temperature_;
  for (int k = 0; k < size(); ++k) {
    const Ellipsoid& ellipsoid = ellipsoids_[static_cast<std::size_t>(k)];
    const KinematicState::Link& link = state.link(ellipsoid.joint);
    const Eigen::Matrix3d to_axes = ellipsoid.axes_T * link.R_WL.transpose();
    const Eigen::Vector3d centre = link.p_WL + link.R_WL * ellipsoid.mean;
    // h >= slimness (|e| − extent) − r: farther than this, a point is out of reach.
    const double far = ellipsoid.extent + (reach + horizon) / ellipsoid.slimness;

    BoltzmannMean mean(temperature_);
    int nearest = -1;
    for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
      const Eigen::Vector3d x = obstacles.points().col(n);
      const Eigen::Vector3d offset = x - centre;
      const double radius = obstacles.radii()[n];
      const double cut = far + radius / ellipsoid.slimness;
      if (offset.squaredNorm() >= cut * cut) {
        continue;
      }
      const PointClearance point = point_clearance(to_axes * offset, ellipsoid.precisions, ellipsoid.root_level);
      const double h = point.value - radius;
      if (!(h < reach + horizon) || !mean.matters(h)) {
        continue;
      }
      const Eigen::Vector3d x_dot = obstacles.velocities().col(n);
      const Eigen::Vector3d slip = x_dot - link.velocity.linear - link.velocity.angular.cross(x);
      const Eigen::Vector3d slip_dot = -link.bias.linear - link.bias.angular.cross(x) -
                                       link.velocity.angular.cross(x_dot) - link.velocity.angular.cross(slip);
      const Eigen::Vector3d e_dot = to_axes * slip;
      const double rate = point.gradient.dot(e_dot);
      const double curvature =
          point.gradient.dot(to_axes * slip_dot) + point.quadratic(e_dot, rate, ellipsoid.precisions);
      const Eigen::Vector3d f = to_axes.transpose() * point.gradient;
      if (mean.add({h, rate, curvature, {{-x.cross(f), -f}, {}}})) {
        nearest = static_cast<int>(n);
      }
    }
    if (mean.empty()) {
      continue;
    }
    const ClearanceSample result = mean.result();
    if (result.value < reach) {
      out.values[k] = result.value;
      out.rates[k] = result.rate;
      out.curvatures[k] = result.curvature;
      out.nearest[k] = nearest;
      out.gradients.col(k).setZero();
      accumulate_generalised_force(state, ellipsoid.joint, result.gradient.first, out.gradients.col(k));
    }
  }
}

}  // namespace sidestep
