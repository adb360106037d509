#include "sidestep/embedding/self_collision_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sidestep {
namespace {

constexpr const char* self_owner = "self-collision barrier";
constexpr const char* plane_owner = "plane barrier";

/// An ellipsoid in the world, with the motion of its centre.
struct Placed {
  const KinematicState::Link& link;
  const BodyEllipsoid& ellipsoid;
  Eigen::Vector3d centre;
  PointMotion motion;

  Placed(const KinematicState& state, const BodyEllipsoid& e) noexcept
      : link(link_or_world(state, e.joint)),
        ellipsoid(e),
        centre(link.p_WL + link.R_WL * e.mean),
        motion(point_motion(link, centre)) {}
};

/// Half-width s of an ellipsoid along a unit vector n that moves, with s' and s'' and the vector ∂s/∂n (world).
struct HalfWidth {
  double value, rate, curvature;
  Eigen::Vector3d slope;
};

HalfWidth half_width(const Placed& p, const Eigen::Vector3d& n, const Eigen::Vector3d& n_dot,
                     const Eigen::Vector3d& n_ddot) noexcept {
  // n seen from the link; d/dt (Rᵀ z) = Rᵀ (ż − ω × z), twice.
  const Eigen::Vector3d& omega = p.link.velocity.angular;
  const Eigen::Vector3d turning = n_dot - omega.cross(n);
  const Eigen::Vector3d turning_dot =
      n_ddot - p.link.bias.angular.cross(n) - omega.cross(n_dot) - omega.cross(turning);
  const Eigen::Vector3d m = p.link.R_WL.transpose() * n;
  const Eigen::Vector3d m_dot = p.link.R_WL.transpose() * turning;
  const Eigen::Vector3d m_ddot = p.link.R_WL.transpose() * turning_dot;
  const Eigen::Vector3d S_m = p.ellipsoid.shape * m;
  const double s = std::sqrt(m.dot(S_m));
  const double rate = S_m.dot(m_dot) / s;
  return {s, rate, (m_dot.dot(p.ellipsoid.shape * m_dot) + S_m.dot(m_ddot) - rate * rate) / s,
          p.link.R_WL * S_m / s};
}

// Centres closer than this have no direction between them [m]; such ellipsoids overlap deeply anyway.
constexpr double closest_centres = 1e-6;

ClearanceSample between(const Placed& a, const Placed& b) noexcept {
  Eigen::Vector3d d = b.centre - a.centre;
  if (!(d.norm() > closest_centres)) {
    d = closest_centres * Eigen::Vector3d::UnitX();
  }
  const Eigen::Vector3d d_dot = b.motion.velocity - a.motion.velocity;
  const Eigen::Vector3d d_ddot = b.motion.acceleration - a.motion.acceleration;
  const double length = d.norm();
  const Eigen::Vector3d n = d / length;
  const double length_dot = n.dot(d_dot);
  const Eigen::Vector3d n_dot = (d_dot - length_dot * n) / length;
  const double length_ddot = n.dot(d_ddot) + length * n_dot.squaredNorm();
  const Eigen::Vector3d n_ddot = (d_ddot - 2.0 * length_dot * n_dot - length_ddot * n) / length;
  const HalfWidth s_a = half_width(a, n, n_dot, n_ddot);
  const HalfWidth s_b = half_width(b, n, n_dot, n_ddot);

  // δh = n·δd − k·δn + Σ_i δθ_i·(n × k_i), with δn = (I − n nᵀ) δd / |d| and k = k_a + k_b the slopes.
  const Eigen::Vector3d k = s_a.slope + s_b.slope;
  const Eigen::Vector3d f = n - (k - n.dot(k) * n) / length;
  return {length - s_a.value - s_b.value,
          length_dot - s_a.rate - s_b.rate,
          length_ddot - s_a.curvature - s_b.curvature,
          {{-a.centre.cross(f) + n.cross(s_a.slope), -f}, {b.centre.cross(f) + n.cross(s_b.slope), f}}};
}

void write(const ClearanceSample& sample, int nearest, const KinematicState& state, int joint_a, int joint_b,
           Eigen::Index k, ClearanceView& out) noexcept {
  out.values[k] = sample.value;
  out.rates[k] = sample.rate;
  out.curvatures[k] = sample.curvature;
  out.nearest[k] = nearest;
  out.gradients.col(k).setZero();
  accumulate_generalised_force(state, joint_a, sample.gradient.first, out.gradients.col(k));
  accumulate_generalised_force(state, joint_b, sample.gradient.second, out.gradients.col(k));
}

void check_temperature(double temperature, const char* owner) {
  if (!(temperature > 0.0) || !std::isfinite(temperature)) {
    throw std::invalid_argument(std::string(owner) + ": temperature is " + std::to_string(temperature) +
                                " m, must be positive and finite");
  }
}

std::vector<BodyEllipsoid> of_link(const std::vector<BodyEllipsoid>& all, const Body& body, const std::string& link,
                                   const char* owner) {
  std::vector<BodyEllipsoid> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found), [&](const BodyEllipsoid& e) {
    return body.links[static_cast<std::size_t>(e.component)] == link;
  });
  if (found.empty()) {
    throw std::invalid_argument(std::string(owner) + ": the body has no ellipsoid on link '" + link + "'");
  }
  return found;
}

}  // namespace

SelfCollisionBarrier::SelfCollisionBarrier(const Robot& robot, const Body& body,
                                           const std::vector<std::pair<std::string, std::string>>& pairs,
                                           BarrierFunction barrier, double temperature)
    : Barrier(robot, barrier, self_owner), temperature_(temperature) {
  check_temperature(temperature, self_owner);
  if (pairs.empty()) {
    throw std::invalid_argument(std::string(self_owner) + ": there is no pair of links");
  }
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot, body, self_owner);
  const auto group = [&](const std::string& link) {
    Group g{link, robot.frames()[static_cast<std::size_t>(robot.frame_index(link))].joint,
            of_link(all, body, link, self_owner), Eigen::Vector3d::Zero(), 0.0};
    for (const BodyEllipsoid& e : g.ellipsoids) {
      g.centre += e.mean / static_cast<double>(g.ellipsoids.size());
    }
    for (const BodyEllipsoid& e : g.ellipsoids) {
      g.radius = std::max(g.radius, (e.mean - g.centre).norm() + e.extent);
    }
    return g;
  };
  for (const auto& [a, b] : pairs) {
    Pair pair{group(a), group(b)};
    if (pair.first.joint == pair.second.joint) {
      throw std::invalid_argument(std::string(self_owner) + ": links '" + a + "' and '" + b +
                                  "' are rigidly connected, so nothing could keep them apart");
    }
    pairs_.push_back(std::move(pair));
  }
  set_num_coordinates(static_cast<int>(pairs_.size()));
}

void SelfCollisionBarrier::add_to(EmbeddingView out, const KinematicState& state,
                                  const Obstacles& /*obstacles*/) const noexcept {
  const double reach = function().activation;
  const double horizon = reach + BoltzmannMean::window * temperature_;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Group& first = pairs_[i].first;
    const Group& second = pairs_[i].second;
    const KinematicState::Link& link_a = link_or_world(state, first.joint);
    const KinematicState::Link& link_b = link_or_world(state, second.joint);
    const Eigen::Vector3d apart =
        link_b.p_WL + link_b.R_WL * second.centre - link_a.p_WL - link_a.R_WL * first.centre;
    if (apart.norm() > first.radius + second.radius + horizon) {
      continue;
    }
    BoltzmannMean mean(temperature_);
    int nearest = -1;
    for (const BodyEllipsoid& ellipsoid_a : first.ellipsoids) {
      const Placed a(state, ellipsoid_a);
      for (const BodyEllipsoid& ellipsoid_b : second.ellipsoids) {
        // Balls around the two are farther apart than anything that matters: most pairs end here.
        const Eigen::Vector3d centre_b = link_b.p_WL + link_b.R_WL * ellipsoid_b.mean;
        const double cut = ellipsoid_a.extent + ellipsoid_b.extent + std::min(horizon, mean.horizon());
        if (cut <= 0.0 || (centre_b - a.centre).squaredNorm() >= cut * cut) {
          continue;
        }
        const ClearanceSample sample = between(a, Placed(state, ellipsoid_b));
        if (sample.value < horizon && mean.matters(sample.value) && mean.add(sample)) {
          nearest = ellipsoid_b.component;
        }
      }
    }
    if (!mean.empty()) {
      const ClearanceSample result = mean.result();
      if (result.value < reach) {
        write(result, nearest, state, first.joint, second.joint, k, out.clearances);
      }
    }
  }
  add_barriers(out);
}

CoordinateLabel SelfCollisionBarrier::label(int k) const {
  const Pair& pair = pairs_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, pair.first.link, pair.second.link, function().floor};
}

PlaneBarrier::PlaneBarrier(const Robot& robot, const Body& body, const Eigen::Vector3d& point,
                           const Eigen::Vector3d& normal, const std::vector<std::string>& links,
                           BarrierFunction barrier, double temperature)
    : Barrier(robot, barrier, plane_owner),
      normal_(normal.normalized()),
      offset_(normal_.dot(point)),
      temperature_(temperature),
      names_(links) {
  check_temperature(temperature, plane_owner);
  if (!point.allFinite() || !normal.allFinite() || !(normal.norm() > 0.0)) {
    throw std::invalid_argument(std::string(plane_owner) + ": point and normal must be finite, and normal not zero");
  }
  if (links.empty()) {
    throw std::invalid_argument(std::string(plane_owner) + ": there is no link to keep off the plane");
  }
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot, body, plane_owner);
  for (const std::string& link : links) {
    links_.push_back(of_link(all, body, link, plane_owner));
    if (links_.back().front().joint < 0) {
      throw std::invalid_argument(std::string(plane_owner) + ": no joint moves link '" + link + "'");
    }
  }
  set_num_coordinates(static_cast<int>(links_.size()));
}

CoordinateLabel PlaneBarrier::label(int k) const {
  return {CoordinateLabel::Kind::plane, names_[static_cast<std::size_t>(k)], {}, function().floor};
}

void PlaneBarrier::add_to(EmbeddingView out, const KinematicState& state,
                          const Obstacles& /*obstacles*/) const noexcept {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    BoltzmannMean mean(temperature_);
    int nearest = -1;
    for (const BodyEllipsoid& ellipsoid : links_[i]) {
      const Placed placed(state, ellipsoid);
      const HalfWidth s = half_width(placed, normal_, zero, zero);
      const double value = normal_.dot(placed.centre) - offset_ - s.value;
      if (!(value < function().activation + BoltzmannMean::window * temperature_) || !mean.matters(value)) {
        continue;
      }
      // δh = normal·δp + δθ·(normal × slope).
      const SpatialForce wrench{placed.centre.cross(normal_) + normal_.cross(s.slope), normal_};
      if (mean.add({value, normal_.dot(placed.motion.velocity) - s.rate,
                    normal_.dot(placed.motion.acceleration) - s.curvature, {wrench, {}}})) {
        nearest = ellipsoid.component;
      }
    }
    if (!mean.empty()) {
      const ClearanceSample result = mean.result();
      if (result.value < function().activation) {
        write(result, nearest, state, links_[i].front().joint, -1, k, out.clearances);
      }
    }
  }
  add_barriers(out);
}

}  // namespace sidestep
