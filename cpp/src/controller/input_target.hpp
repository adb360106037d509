#pragma once

#include <Eigen/Core>

#include "reference.hpp"
#include "sidestep/attractor/goal.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// What a velocity, twist or trajectory leads the reference to in this step: where and how it is to move, and the acceleration for
/// that, as a goal whose attraction is that acceleration.
class InputTarget {
 public:
  InputTarget(const JointLimits& limits, const ControllerSettings& settings);

  /// Nothing is followed in this step.
  void clear() noexcept { is_followed_ = waits_ = false; }
  /// The reference is to have this velocity and this acceleration. Barriers hold back what an attraction does towards obstacles,
  /// also where it brakes a motion away from them: that much is given to the damping, which they leave alone.
  void accelerate(const Reference& reference, const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) noexcept;
  /// The same by damping alone: what bounds hold of the velocity is held, and needs no barriers.
  void respond(const Reference& reference, const Eigen::VectorXd& acceleration) noexcept;

  /// The reference rests until the path is free.
  void wait(bool waits) noexcept { waits_ = waits; }

  bool is_followed() const noexcept { return is_followed_; }
  bool waits() const noexcept { return waits_; }
  /// Where and how the reference is to move (JointGoal).
  Goal& motion() noexcept { return motion_; }
  const Goal& motion() const noexcept { return motion_; }
  JointGoal& joint_motion() noexcept { return std::get<JointGoal>(motion_); }
  /// The goal whose attraction is the acceleration.
  const Goal& attraction() const noexcept { return attraction_; }
  /// That `accelerate` was given last [rad/s² | m/s²].
  const Eigen::VectorXd& desired_acceleration() const noexcept { return desired_acceleration_; }
  void go_on_from(const InputTarget& before) noexcept;

 private:
  const JointLimits& limits_;
  const ControllerSettings& settings_;
  Goal motion_, attraction_;
  Eigen::VectorXd desired_acceleration_;
  bool is_followed_ = false, waits_ = false;
};

}  // namespace sidestep
