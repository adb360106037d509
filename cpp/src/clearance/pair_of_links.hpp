#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <vector>

#include "../math/kernels/most_lanes.hpp"
#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "sidestep/clearance/link_ellipsoids.hpp"
#include "sidestep/clearance/stopping_clearance.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// The ellipsoids of two links at a state, in the frame of the first.
class PairOfLinks {
 public:
  PairOfLinks(const KinematicState& state, const LinkEllipsoids& first, const LinkEllipsoids& second) noexcept
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
    for (const LinkEllipsoid& b : b_.ellipsoids) {
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
    const std::vector<LinkEllipsoid>& ellipsoids;
    const std::vector<EllipsoidRow>& rows;
    Eigen::Vector3d centre;  // Centre of a ball around them [m].
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
  SpatialMotion velocity_;  // Velocity of the second link, seen from the first, at its origin.
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
  static constexpr int capacity = 128;  // Most ellipsoid pairs in one batch.

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
  std::array<int, EllipsoidPairs::capacity> components_;  // Components of the second link.
  int nearest_ = -1;
  double horizon_, window_;
  double least_, least_ahead_;  // Smallest gap, and smallest h + τ h', so far.
  int size_ = 0;
  std::array<Pair, capacity> pairs_;
};

/// Of two links that may be within reach of each other.
inline MeanGap solved(const PairOfLinks& pair, double temperature, double horizon, double reach, double reach_ahead) noexcept {
  MeanGap gaps(pair, temperature, horizon, reach, reach_ahead);
  pair.find_below(reach + BoltzmannMean::window * temperature, [&](const auto&... near) {
    gaps.add(near...);
    return false;
  });
  gaps.solve();
  return gaps;
}

}  // namespace sidestep
