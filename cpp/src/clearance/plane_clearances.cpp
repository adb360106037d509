#include "sidestep/clearance/plane_clearances.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "sidestep/clearance/boltzmann_mean.hpp"

namespace sidestep {
namespace {

/// Half-width s of a link's ellipsoid along a unit vector n that stands still, with s' and s'' at q̈ = 0.
struct Support {
  double value, rate, curvature;
  Eigen::Vector3d point;  ///< Boundary point farthest along n, from the centre (world) [m].

  Support(const KinematicState::Link& link, const BodyEllipsoid& ellipsoid, const Eigen::Vector3d& n) noexcept {
    // n seen from the link; d/dt (Rᵀ z) = Rᵀ (ż − ω × z), twice.
    const Eigen::Vector3d& omega = link.velocity.angular;
    const Eigen::Vector3d turning = n.cross(omega);
    const Eigen::Vector3d m = link.R_WL.transpose() * n;
    const Eigen::Vector3d m_dot = link.R_WL.transpose() * turning;
    const Eigen::Vector3d m_ddot = link.R_WL.transpose() * (n.cross(link.bias.angular) - omega.cross(turning));
    const Eigen::Vector3d S_m = ellipsoid.shape * m;
    value = std::sqrt(m.dot(S_m));
    rate = S_m.dot(m_dot) / value;
    curvature = (m_dot.dot(ellipsoid.shape * m_dot) + S_m.dot(m_ddot) - rate * rate) / value;
    point = link.R_WL * S_m / value;
  }
};

}  // namespace

PlaneClearances::PlaneClearances(const Robot& robot, std::shared_ptr<const BodyLinks> links, const KeptPlane& plane,
                                 double temperature, const char* owner)
    : temperature_(checked_temperature(temperature, owner)),
      links_(std::move(links)),
      normal_(plane.normal.normalized()),
      offset_(normal_.dot(plane.point)) {
  if (!plane.point.allFinite() || !plane.normal.allFinite() || !(plane.normal.norm() > 0.0)) {
    throw std::invalid_argument(std::string(owner) + ": point and normal must be finite, and normal not zero");
  }
  if (plane.links.empty()) {
    throw std::invalid_argument(std::string(owner) + ": there is no link to keep off the plane");
  }
  for (const std::string& name : plane.links) {
    kept_.push_back(links_->index(robot, name, owner));
    if ((*links_)[kept_.back()].joint < 0) {
      throw std::invalid_argument(std::string(owner) + ": no joint moves link '" + name + "'");
    }
  }
}

CoordinateLabel PlaneClearances::label(int k) const { return {CoordinateLabel::Kind::plane, (*links_)[link(k)].name}; }

void PlaneClearances::evaluate(const KinematicState& state, const Obstacles& /*obstacles*/, double reach, const Horizon& ahead,
                               ClearanceView out) const noexcept {
  for (int k = 0; k < size(); ++k) {
    const LinkEllipsoids& kept = (*links_)[link(k)];
    const KinematicState::Link& link = state.link(kept.joint);
    BoltzmannMean mean(temperature_);
    StoppingClearance approach(temperature_, ahead.time);
    int nearest = -1;
    for (const LinkEllipsoid& ellipsoid : kept.ellipsoids) {
      const Eigen::Vector3d centre = link.p_WL + link.R_WL * ellipsoid.mean;
      const Support support(link, ellipsoid, normal_);
      const double value = normal_.dot(centre) - offset_ - support.value;
      const PointMotion motion = point_motion(link, centre);
      const SpatialForce wrench{(centre - support.point).cross(normal_), normal_};
      const ClearanceSample sample{value,
                                   normal_.dot(motion.velocity) - support.rate,
                                   normal_.dot(motion.acceleration) - support.curvature,
                                   {wrench, {}}};
      approach.add(sample);
      if (mean.matters(value) && mean.add(sample)) {
        nearest = ellipsoid.component;
      }
    }
    const ClearanceSample result = mean.result(), minded = approach.result();
    if (result.value < reach || minded.value + ahead.time * minded.rate < ahead.distance) {
      write(result, state, kept.joint, -1, k, out);
      write(minded, state, kept.joint, -1, k, out.approach);
      out.nearest[k] = nearest;
      out.least[k] = mean.least();
    }
  }
}

}  // namespace sidestep
