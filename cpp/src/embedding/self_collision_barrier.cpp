#include "sidestep/embedding/self_collision_barrier.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "sidestep/embedding/ellipsoid_gap.hpp"

namespace sidestep {
namespace {

constexpr const char* self_owner = "self-collision barrier";
constexpr const char* plane_owner = "plane barrier";
constexpr double closest_centres = 1e-6;  // [m] of which a direction is taken

/// An ellipsoid in the world.
struct Side {
  const KinematicState::Link* link;
  const BodyEllipsoid* ellipsoid;
  Eigen::Vector3d centre;

  Eigen::Matrix3d shape() const noexcept { return link->R_WL * ellipsoid->shape * link->R_WL.transpose(); }
  double half_width(const Eigen::Vector3d& n) const noexcept {
    const Eigen::Vector3d m = link->R_WL.transpose() * n;
    return std::sqrt(m.dot(ellipsoid->shape * m));
  }
};

/// The same, with the motion of its centre.
struct Placed {
  const KinematicState::Link& link;
  const BodyEllipsoid& ellipsoid;
  Eigen::Vector3d centre;
  PointMotion motion;

  Placed(const KinematicState::Link& l, const BodyEllipsoid& e, const Eigen::Vector3d& c) noexcept
      : link(l), ellipsoid(e), centre(c), motion(point_motion(l, c)) {}
  Placed(const KinematicState::Link& l, const BodyEllipsoid& e) noexcept : Placed(l, e, l.p_WL + l.R_WL * e.mean) {}
  explicit Placed(const Side& side) noexcept : Placed(*side.link, *side.ellipsoid, side.centre) {}
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

EllipsoidGap gap_between(const Side& a, const Side& b) noexcept {
  return ellipsoid_gap(b.centre - a.centre, a.shape(), b.shape());
}

/// The boundary point of an ellipsoid farthest along a fixed unit vector n, from the centre, and how it moves.
Eigen::Vector3d support_rate(const Placed& p, const Eigen::Vector3d& n) noexcept {
  const Eigen::Vector3d& omega = p.link.velocity.angular;
  const Eigen::Vector3d m = p.link.R_WL.transpose() * n;
  const Eigen::Vector3d m_dot = p.link.R_WL.transpose() * n.cross(omega);
  const Eigen::Vector3d S_m = p.ellipsoid.shape * m;
  const double s = std::sqrt(m.dot(S_m));
  const Eigen::Vector3d k_dot = (p.ellipsoid.shape * m_dot - S_m * (S_m.dot(m_dot) / (s * s))) / s;
  return omega.cross(p.link.R_WL * S_m / s) + p.link.R_WL * k_dot;
}

ClearanceSample between(const Placed& a, const Placed& b, const EllipsoidGap& gap) noexcept {
  const Eigen::Vector3d d = b.centre - a.centre;
  const Eigen::Vector3d d_dot = b.motion.velocity - a.motion.velocity;
  const Eigen::Vector3d d_ddot = b.motion.acceleration - a.motion.acceleration;
  const Eigen::Vector3d& n = gap.normal;
  // n keeps the slope of φ across it at zero. To first order h does not feel that n turns; n'' counts along n alone.
  const Eigen::Vector3d n_dot = gap.turn(d_dot - support_rate(a, n) - support_rate(b, n));
  const Eigen::Vector3d n_ddot = -n_dot.squaredNorm() * n;
  const HalfWidth s_a = half_width(a, n, n_dot, n_ddot);
  const HalfWidth s_b = half_width(b, n, n_dot, n_ddot);
  return {gap.value,
          n.dot(d_dot) + n_dot.dot(d) - s_a.rate - s_b.rate,
          n.dot(d_ddot) + 2.0 * n_dot.dot(d_dot) + n_ddot.dot(d) - s_a.curvature - s_b.curvature,
          {{-(a.centre + s_a.slope).cross(n), -n}, {(b.centre - s_b.slope).cross(n), n}}};
}

/// The ellipsoids of two links at a state.
class PairOfLinks {
 public:
  template <class Group>
  PairOfLinks(const KinematicState& state, const Group& first, const Group& second) noexcept
      : first_(ball(state, first)), second_(ball(state, second)) {}

  /// Calls act(a, b, bound) for pairs of ellipsoids of which a lower bound of the gap is below the limit, which `act` may
  /// lower. Balls are tested from the whole links down: most pairs of links, then of ellipsoids, are too far apart.
  template <class Act>
  void for_each_below(const double& limit, Act&& act) const noexcept {
    if (!near(first_, second_.centre, second_.radius, limit)) {
      return;
    }
    constexpr std::size_t most = 32;  // ellipsoids of the second link that are looked at together
    const std::vector<BodyEllipsoid>& all = *second_.ellipsoids;
    for (std::size_t start = 0; start < all.size(); start += most) {
      std::array<Side, most> sides;
      std::size_t num = 0;
      for (std::size_t n = start; n < std::min(start + most, all.size()); ++n) {
        const Eigen::Vector3d centre = second_.link->p_WL + second_.link->R_WL * all[n].mean;
        if (near(first_, centre, all[n].extent, limit)) {
          sides[num++] = {second_.link, &all[n], centre};
        }
      }
      for (std::size_t m = 0; num > 0 && m < first_.ellipsoids->size(); ++m) {
        const BodyEllipsoid& ellipsoid = (*first_.ellipsoids)[m];
        const Side a{first_.link, &ellipsoid, first_.link->p_WL + first_.link->R_WL * ellipsoid.mean};
        if (!near(second_, a.centre, ellipsoid.extent, limit)) {
          continue;
        }
        for (std::size_t n = 0; n < num; ++n) {
          const Side& b = sides[n];
          if (!near(a.centre, b.centre, ellipsoid.extent + b.ellipsoid->extent + limit)) {
            continue;
          }
          const Eigen::Vector3d d = b.centre - a.centre;
          const double length = std::max(d.norm(), closest_centres);
          const double bound = length - a.half_width(d / length) - b.half_width(d / length);
          if (bound < limit) {
            act(a, b, bound);
          }
        }
      }
    }
  }

 private:
  struct Ball {
    const KinematicState::Link* link;
    const std::vector<BodyEllipsoid>* ellipsoids;
    Eigen::Vector3d centre;
    double radius;
  };
  template <class Group>
  static Ball ball(const KinematicState& state, const Group& group) noexcept {
    const KinematicState::Link& link = link_or_world(state, group.joint);
    return {&link, &group.ellipsoids, link.p_WL + link.R_WL * group.centre, group.radius};
  }
  static bool near(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double distance) noexcept {
    return distance > 0.0 && (b - a).squaredNorm() < distance * distance;
  }
  static bool near(const Ball& ball, const Eigen::Vector3d& centre, double radius, double limit) noexcept {
    return near(ball.centre, centre, ball.radius + radius + limit);
  }

  Ball first_, second_;
};

void write(const ClearanceSample& sample, int nearest, const KinematicState& state, int joint_a, int joint_b,
           Eigen::Index k, ClearanceView& out) noexcept {
  out.values[k] = sample.value;
  out.rates[k] = sample.rate;
  out.curvatures[k] = sample.curvature;
  out.mixing[k] = sample.mixing;
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

void check_reach(double reach, const char* owner) {
  if (!std::isfinite(reach)) {
    throw std::invalid_argument(std::string(owner) + ": reach is " + std::to_string(reach) + " m, must be finite");
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
                                           const std::vector<LinkPair>& pairs, BarrierFunction barrier, double temperature,
                                           double reach)
    : Barrier(robot, barrier, self_owner), temperature_(temperature), reach_(std::max(reach, barrier.activation)) {
  check_reach(reach, self_owner);
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
  for (const auto& [a, b, contact] : pairs) {
    Pair pair{group(a), group(b), contact};
    if (!std::isfinite(contact)) {
      throw std::invalid_argument(std::string(self_owner) + ": contact of links '" + a + "' and '" + b + "' is " +
                                  std::to_string(contact) + " m, must be finite");
    }
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
  const double window = BoltzmannMean::window * temperature_;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const PairOfLinks pair(state, pairs_[i].first, pairs_[i].second);
    // The smallest gap first, from that with the smallest bound: most pairs of links end here, and of the others only
    // what lies near it matters.
    const double reach = reach_ + pairs_[i].contact;  // of the gap
    double least_bound = reach;
    Side first, second;
    pair.for_each_below(least_bound, [&](const Side& a, const Side& b, double bound) {
      first = a, second = b;
      least_bound = bound;
    });
    if (!(least_bound < reach)) {
      continue;
    }
    double smallest = std::min(reach, gap_between(first, second).value);
    pair.for_each_below(smallest, [&](const Side& a, const Side& b, double /*bound*/) {
      smallest = std::min(smallest, gap_between(a, b).value);
    });
    if (!(smallest < reach)) {
      continue;
    }
    BoltzmannMean mean(temperature_);
    int nearest = -1;
    const double limit = smallest + window;
    pair.for_each_below(limit, [&](const Side& a, const Side& b, double /*bound*/) {
      const EllipsoidGap gap = gap_between(a, b);
      if (gap.value < limit && mean.add(between(Placed(a), Placed(b), gap))) {
        nearest = b.ellipsoid->component;
      }
    });
    ClearanceSample result = mean.result();
    result.value -= pairs_[i].contact;
    if (result.value < reach_) {
      write(result, nearest, state, pairs_[i].first.joint, pairs_[i].second.joint, static_cast<Eigen::Index>(i),
            out.clearances);
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
                           BarrierFunction barrier, double temperature, double reach)
    : Barrier(robot, barrier, plane_owner),
      normal_(normal.normalized()),
      offset_(normal_.dot(point)),
      temperature_(temperature),
      reach_(std::max(reach, barrier.activation)),
      names_(links) {
  check_reach(reach, plane_owner);
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
      const Placed placed(link_or_world(state, ellipsoid.joint), ellipsoid);
      const HalfWidth s = half_width(placed, normal_, zero, zero);
      const double value = normal_.dot(placed.centre) - offset_ - s.value;
      if (!(value < reach_ + BoltzmannMean::window * temperature_) || !mean.matters(value)) {
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
      if (result.value < reach_) {
        write(result, nearest, state, links_[i].front().joint, -1, k, out.clearances);
      }
    }
  }
  add_barriers(out);
}

}  // namespace sidestep
