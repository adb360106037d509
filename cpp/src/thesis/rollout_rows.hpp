#pragma once

#include <optional>

#include "sidestep/thesis/rollout.hpp"

namespace sidestep {

/// Throws std::invalid_argument if so many records, one motion each, would be too large together, or as `rollout` does
/// on the period and the steps.
void check_records(const GeometricSystem& system, const RolloutSettings& settings, Eigen::Index motions);

/// A rollout with all its rows, which are still to be written. Throws as `rollout` does on the period and the steps.
Rollout make_rollout(const GeometricSystem& system, const RolloutSettings& settings);

/// Obstacles that move from where they were at the start. Those at rest are not copied.
class ObstaclesInMotion {
 public:
  explicit ObstaclesInMotion(const Obstacles& start) : start_(start) {
    if (start.tree().moves()) {
      moved_ = start;
    }
  }
  const Obstacles& now() const noexcept { return moved_ ? *moved_ : start_; }
  void advance(double duration) noexcept {
    if (moved_) {
      moved_->advance(duration);
    }
  }

 private:
  const Obstacles& start_;
  std::optional<Obstacles> moved_;
};

/// (q, v) after `dt` of one acceleration, by an integrator that holds it.
template <class Numbers>
void hold(Integrator integrator, double dt, const Numbers& a, Numbers& q, Numbers& v) {
  if (integrator == Integrator::second_order) {
    q += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
  } else {
    v += dt * a;
    q += dt * v;
  }
}

}  // namespace sidestep
