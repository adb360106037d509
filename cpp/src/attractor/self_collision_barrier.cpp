#include "sidestep/attractor/self_collision_barrier.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "../math/kernels/most_lanes.hpp"

namespace sidestep {
namespace {

constexpr const char* self_owner = "self-collision barrier";
constexpr const char* plane_owner = "plane barrier";
constexpr int configurations = 101;  // of which the usual clearance of two links is the median
constexpr int newton_steps = 30;

/// The ellipsoids of two links at a state, in the frame of the first.
class PairOfLinks {
 public:
  template <class Group>
  PairOfLinks(const KinematicState& state, const Group& first, const Group& second) noexcept
      : first_(link_or_world(state, first.joint)),
        second_(link_or_world(state, second.joint)),
        R_(first_.R_WL.transpose() * second_.R_WL),
        p_(first_.R_WL.transpose() * (second_.p_WL - first_.p_WL)),
        velocity_(
            in_first(second_.velocity.angular - first_.velocity.angular, second_.velocity.linear - first_.velocity.linear)),
        a_{first.ellipsoids, first.rows, first.centre, first.radius},
        b_{second.ellipsoids, second.rows, R_ * second.centre + p_, second.radius} {}

  /// Calls act(a, b, bound) for pairs of ellipsoids of which a lower bound of the gap is below the limit, until it
  /// returns true; returns whether it did. Most ellipsoids are too far from a ball around all of the other link.
  template <class Act>
  bool find_below(double limit, Act&& act) const noexcept {
    if (!within(limit)) {
      return false;
    }
    for (const BodyEllipsoid& b : b_.ellipsoids) {
      const Eigen::Vector3d centre = R_ * b.mean + p_;
      if (!near(a_.centre, centre, a_.radius + b.extent + limit)) {
        continue;
      }
      auto a = a_.ellipsoids.begin();
      for (const EllipsoidRow& row : a_.rows) {
        std::array<double, EllipsoidRow::capacity> bounds;
        row.bound(R_, centre, b.shape, bounds);
        for (int i = 0; i < row.size(); ++i, ++a) {
          const double bound = bounds[static_cast<std::size_t>(i)];
          if (bound < limit && act(*a, b, bound)) {
            return true;
          }
        }
      }
    }
    return false;
  }

  EllipsoidGaps gaps() const noexcept {
    // Seen from the first, V = V_2 − V_1, and V' less what the first turns it by, A_2 − A_1 − V_1 × V.
    const SpatialMotion& own = first_.velocity;
    const Eigen::Vector3d angular = second_.velocity.angular - own.angular, linear = second_.velocity.linear - own.linear;
    return {R_, p_, velocity_,
            in_first(second_.bias.angular - first_.bias.angular - own.angular.cross(angular),
                     second_.bias.linear - first_.bias.linear - own.angular.cross(linear) - own.linear.cross(angular))};
  }

  /// Whether the balls around the links are so near that a gap may be below the limit.
  bool within(double limit) const noexcept { return near(a_.centre, b_.centre, a_.radius + b_.radius + limit); }
  /// No gap shrinks faster [m/s].
  double speed() const noexcept { return velocity_at(b_.centre).norm() + velocity_.angular.norm() * b_.radius; }
  /// Nor faster than this, which takes longer.
  double closing_speed() const noexcept { return closing_speed(a_.centre, a_.radius, b_.centre, b_.radius); }
  /// Nor that of a and b.
  double closing_speed(const BodyEllipsoid& a, const BodyEllipsoid& b) const noexcept {
    return closing_speed(a.mean, a.extent, R_ * b.mean + p_, b.extent);
  }

  /// With equal and opposite wrenches about the world origin: they act at either end of the gap, along it.
  ClearanceSample sample(const EllipsoidGap& gap) const noexcept {
    const Eigen::Vector3d n = first_.R_WL * gap.normal, moment = (first_.R_WL * gap.contact + first_.p_WL).cross(n);
    return {gap.value, gap.rate, gap.curvature, {{-moment, -n}, {moment, n}}};
  }

 private:
  struct Ellipsoids {
    const std::vector<BodyEllipsoid>& ellipsoids;
    const std::vector<EllipsoidRow>& rows;
    Eigen::Vector3d centre;  // of a ball around them
    double radius;
  };
  /// What is taken at the world origin and expressed in the world, at the origin of the first link and in its frame.
  SpatialMotion in_first(const Eigen::Vector3d& angular, const Eigen::Vector3d& linear) const noexcept {
    return {first_.R_WL.transpose() * angular, first_.R_WL.transpose() * (linear + angular.cross(first_.p_WL))};
  }
  Eigen::Vector3d velocity_at(const Eigen::Vector3d& point) const noexcept {
    return velocity_.linear + velocity_.angular.cross(point);
  }
  /// Of balls.
  double closing_speed(const Eigen::Vector3d& a, double radius_a, const Eigen::Vector3d& b, double radius_b) const noexcept {
    const Eigen::Vector3d d = a - b, v = velocity_at(b);
    return Horizon::closing_speed(d.dot(v), d.norm(), radius_a + radius_b, v.norm()) + velocity_.angular.norm() * radius_b;
  }
  static bool near(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double distance) noexcept {
    return distance > 0.0 && (b - a).squaredNorm() < distance * distance;
  }

  const KinematicState::Link &first_, &second_;
  Eigen::Matrix3d R_;
  Eigen::Vector3d p_;
  SpatialMotion velocity_;  // of the second, seen from the first, at its origin
  Ellipsoids a_, b_;
};

/// The means of the gaps of two links, over pairs of ellipsoids that come in any order, with lower bounds of their
/// gaps.
class MeanGap {
 public:
  /// Gaps matter up to a window beyond `reach`, or beyond `reach_ahead` once the horizon is over [m].
  MeanGap(const PairOfLinks& links, double temperature, double horizon, double reach, double reach_ahead) noexcept
      : links_(links),
        mean_(temperature),
        approach_(temperature, horizon),
        gaps_(links.gaps()),
        horizon_(horizon),
        window_(BoltzmannMean::window * temperature),
        least_(reach),
        least_ahead_(reach_ahead) {}

  void add(const BodyEllipsoid& a, const BodyEllipsoid& b, double bound) noexcept {
    if (size_ == capacity) {
      solve();
    }
    pairs_[static_cast<std::size_t>(size_++)] = {&a, &b, bound};
  }

  /// To be called after all have been added, and before what follows.
  void solve() noexcept {
    // After those of the smallest bounds, most others need no solution.
    const auto first = pairs_.begin() + std::min(size_, kernels::most_lanes), last = pairs_.begin() + size_;
    std::nth_element(pairs_.begin(), first, last, [](const Pair& x, const Pair& y) { return x.bound < y.bound; });
    std::for_each(pairs_.begin(), first, [&](const Pair& pair) { choose(pair); });
    solve_chosen();
    const double near = least_ + window_, minded = least_ahead_ + window_;
    std::for_each(first, last, [&](const Pair& pair) {
      if (pair.bound < near || pair.bound - horizon_ * links_.closing_speed(*pair.a, *pair.b) < minded) {
        choose(pair);
      }
    });
    solve_chosen();
    size_ = 0;
  }

  ClearanceSample mean() const noexcept { return mean_.result(); }
  ClearanceSample approach() const noexcept { return approach_.result(); }
  double least() const noexcept { return mean_.least(); }
  int nearest() const noexcept { return nearest_; }  ///< of the second link

 private:
  static constexpr int capacity = 128;

  struct Pair {
    const BodyEllipsoid *a, *b;
    double bound;
  };

  void choose(const Pair& pair) noexcept {
    if (gaps_.full()) {
      solve_chosen();
    }
    components_[static_cast<std::size_t>(gaps_.size())] = pair.b->component;
    gaps_.add(pair.a->mean, pair.a->shape, pair.b->mean, pair.b->shape);
  }

  void solve_chosen() noexcept {
    gaps_.solve();
    for (int k = 0; k < gaps_.size(); ++k) {
      const ClearanceSample sample = links_.sample(gaps_[k]);
      least_ = std::min(least_, sample.value);
      least_ahead_ = std::min(least_ahead_, sample.value + horizon_ * sample.rate);
      approach_.add(sample);
      if (mean_.matters(sample.value) && mean_.add(sample)) {
        nearest_ = components_[static_cast<std::size_t>(k)];
      }
    }
    gaps_.clear();
  }

  const PairOfLinks& links_;
  BoltzmannMean mean_;
  StoppingClearance approach_;
  EllipsoidGaps gaps_;
  std::array<int, EllipsoidPairs::capacity> components_;  // of the second link
  int nearest_ = -1;
  double horizon_, window_;
  double least_, least_ahead_;  // gaps, and h + τ h', so far
  int size_ = 0;
  std::array<Pair, capacity> pairs_;
};

/// Half-width s of a link's ellipsoid along a unit vector n that stands still, with s' and s'' at q̈ = 0.
struct Support {
  double value, rate, curvature;
  Eigen::Vector3d point;  ///< of the boundary farthest along n, from the centre (world)

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
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [&](const BodyEllipsoid& e) { return body.links[static_cast<std::size_t>(e.component)] == link; });
  if (found.empty()) {
    throw std::invalid_argument(std::string(owner) + ": the body has no ellipsoid on link '" + link + "'");
  }
  return found;
}

/// Of two links that may be within reach of each other.
MeanGap solved(const PairOfLinks& pair, double temperature, double horizon, double reach, double reach_ahead) noexcept {
  MeanGap gaps(pair, temperature, horizon, reach, reach_ahead);
  pair.find_below(reach + BoltzmannMean::window * temperature, [&](const auto&... near) {
    gaps.add(near...);
    return false;
  });
  gaps.solve();
  return gaps;
}

}  // namespace

SelfCollisionBarrier::SelfCollisionBarrier(const Robot& robot, const Body& body, const std::vector<LinkPair>& pairs,
                                           BarrierFunction barrier, double temperature, double reach)
    : Barrier(robot, barrier, self_owner), temperature_(temperature), reach_(std::max(reach, barrier.activation)) {
  check_reach(reach, self_owner);
  check_temperature(temperature, self_owner);
  if (pairs.empty()) {
    throw std::invalid_argument(std::string(self_owner) + ": there is no pair of links");
  }
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot, body, self_owner);
  const auto group = [&](const std::string& link) {
    Group g{link,
            robot.frames()[static_cast<std::size_t>(robot.frame_index(link))].joint,
            of_link(all, body, link, self_owner),
            {},
            Eigen::Vector3d::Zero(),
            0.0};
    for (const BodyEllipsoid& e : g.ellipsoids) {
      if (g.rows.empty() || g.rows.back().full()) {
        g.rows.emplace_back();
      }
      g.rows.back().add(e.mean, e.shape);
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
  shorten_where_usually_near();
}

void SelfCollisionBarrier::shorten_where_usually_near() {
  const Robot& arm = robot();
  const Eigen::Index nv = arm.num_coordinates();
  // Configurations spread evenly: n α_j modulo 1, with α_j = x^-(j+1) and x^(nv+1) = x + 1 (Roberts 2018).
  double x = 1.5;
  for (int n = 0; n < newton_steps; ++n) {
    const double power = std::pow(x, static_cast<double>(nv));
    x -= (power * x - x - 1.0) / (static_cast<double>(nv + 1) * power - 1.0);
  }
  std::vector<std::vector<double>> near(pairs_.size());
  KinematicState state(arm);
  Eigen::VectorXd q(nv);
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(nv);
  for (int n = 0; n < configurations; ++n) {
    for (Eigen::Index j = 0; j < nv; ++j) {
      const double lower = arm.limits().lower[j], upper = arm.limits().upper[j], turn = 2.0 * std::numbers::pi;
      const double low = std::isfinite(lower) ? lower : std::isfinite(upper) ? upper - turn : -0.5 * turn;
      const double high = std::isfinite(upper) ? upper : low + turn;
      const double place = (static_cast<double>(n) + 0.5) * std::pow(x, -static_cast<double>(j + 1));
      q[j] = low + (place - std::floor(place)) * (high - low);
    }
    state.update(arm, q, v);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double reach = usually_near + pairs_[i].contact;
      const PairOfLinks pair(state, pairs_[i].first, pairs_[i].second);
      if (pair.find_below(reach, [](const auto&...) { return true; })) {
        near[i].push_back(solved(pair, temperature_, 0.0, reach, reach).least() - pairs_[i].contact);
      }
    }
  }
  constexpr auto half = static_cast<std::size_t>(configurations / 2);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (near[i].size() > half) {  // of what is not near, it does not matter how far it is
      std::nth_element(near[i].begin(), near[i].begin() + half, near[i].end());
      shorten_for_usual(static_cast<int>(i), near[i][half]);
    }
  }
}

void SelfCollisionBarrier::add_to(EmbeddingView out, const KinematicState& state,
                                  const Obstacles& /*obstacles*/) const noexcept {
  const Horizon ahead = horizon(state);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const double contact = pairs_[i].contact;
    const PairOfLinks pair(state, pairs_[i].first, pairs_[i].second);
    // Most pairs of links end here.
    if (!pair.within(std::max(reach_, ahead.distance + ahead.time * pair.speed()) + contact)) {
      continue;
    }
    const double reach = std::max(reach_, ahead.distance + ahead.time * pair.closing_speed());
    if (!pair.find_below(reach + contact, [](const auto&...) { return true; })) {
      continue;
    }
    const MeanGap gaps = solved(pair, temperature_, ahead.time, reach + contact, ahead.distance + contact);
    ClearanceSample mean = gaps.mean(), approach = gaps.approach();
    mean.value -= contact;
    approach.value -= contact;
    if (mean.value < reach) {
      const int first_joint = pairs_[i].first.joint, second_joint = pairs_[i].second.joint;
      const auto k = static_cast<Eigen::Index>(i);
      write(mean, state, first_joint, second_joint, k, out.clearances);
      write(approach, state, first_joint, second_joint, k, out.clearances.approach);
      out.clearances.nearest[k] = gaps.nearest();
      out.clearances.least[k] = gaps.least() - contact;
    }
  }
  add_barriers(out);
}

CoordinateLabel SelfCollisionBarrier::label(int k) const {
  const Pair& pair = pairs_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, pair.first.link, pair.second.link, floor(k)};
}

PlaneBarrier::PlaneBarrier(const Robot& robot, const Body& body, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                           const std::vector<std::string>& links, BarrierFunction barrier, double temperature, double reach)
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

void PlaneBarrier::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& /*obstacles*/) const noexcept {
  const Horizon ahead = horizon(state);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    BoltzmannMean mean(temperature_);
    StoppingClearance approach(temperature_, ahead.time);
    int nearest = -1;
    for (const BodyEllipsoid& ellipsoid : links_[i]) {
      const KinematicState::Link& link = link_or_world(state, ellipsoid.joint);
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
    if (result.value < reach_ || minded.value + ahead.time * minded.rate < ahead.distance) {
      const int joint = links_[i].front().joint;
      write(result, state, joint, -1, k, out.clearances);
      write(minded, state, joint, -1, k, out.clearances.approach);
      out.clearances.nearest[k] = nearest;
      out.clearances.least[k] = mean.least();
    }
  }
  add_barriers(out);
}

}  // namespace sidestep
