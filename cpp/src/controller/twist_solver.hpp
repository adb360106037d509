#pragma once

#include <Eigen/Core>

#include "request.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "velocity_bounds.hpp"

namespace sidestep {

/// Joint velocities that move a frame as a twist asks for, as far as singular configurations, limits and clearances leave it.
///
/// J v = s V with the largest s in [0, 1]; what clearances then do not leave is lost by least squares. No allocation after
/// construction.
class TwistSolver {
 public:
  TwistSolver(const Robot& robot, const ControllerSettings& settings, const UsableLimits& usable);

  /// The reference is at q, v.
  void update(const Eigen::VectorXd& q, const Eigen::VectorXd& v) noexcept { state_.update(robot_, q, v); }
  /// Writes the joint velocity for a twist at the last update, and what makes it smaller than asked.
  void solve(const TwistRequest& request, const NearReference& near, VelocityBounds& bounds, Eigen::VectorXd& wanted,
             Reduction& reduction) noexcept;

  const KinematicState& state() const noexcept { return state_; }
  /// The twist that was asked for last, in axes of the world (6) [m/s, rad/s].
  const Vector6d& asked() const noexcept { return twist_; }
  void go_on_from(const TwistSolver& before) noexcept { twist_ = before.twist_; }
  /// What the frame of the last twist does at joint velocities v: J v.
  Vector6d frame_motion(const Eigen::VectorXd& v) const noexcept { return jacobian_transposed_.transpose().lazyProduct(v); }
  /// Writes J⁺ (J v − V), damped where it is singular.
  void write_change(const Eigen::VectorXd& v, Eigen::VectorXd& change) const noexcept;
  /// Squares of the Jacobian's singular values.
  const Vector6d& squares() const noexcept { return squares_; }
  FrameJacobian& projected() noexcept { return projected_; }

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  /// A direction's singular value, and what is asked and may be dropped along it.
  struct Directions {
    Matrix6d U;
    Vector6d sigma, asked, drop;
  };

  static void write_jacobian(const KinematicState& state, const TwistRequest& request, FrameJacobian& transposed) noexcept;
  void take(const TwistRequest& request) noexcept;
  void step_off_singular(const TwistRequest& request) noexcept;
  void scale(const TwistRequest& request, const NearReference& near, VelocityBounds& bounds, Eigen::VectorXd& wanted,
             Reduction& reduction) noexcept;
  /// Writes the velocity for the share that singular values leave of the twist; false where those held move the frame otherwise.
  bool write_scaled(const Matrix6d& U, const Vector6d& squares, const VelocityBounds& bounds, Eigen::Index held,
                    Directions& directions, Eigen::VectorXd& wanted, Reduction& reduction) const noexcept;
  /// The share at which joints keep their bounds.
  double fit_joints(const Eigen::VectorXd& wanted, const VelocityBounds& bounds, Reduction& reduction) const noexcept;
  /// The share of the wanted velocity at which no singular value falls too fast to the one where a twist comes to rest.
  double keep_off_singular(const TwistRequest& request, const Directions& directions, const Eigen::VectorXd& wanted,
                           Reduction& reduction) noexcept;
  /// Least squares among the clearances: v = v_h + P Jᵀ U f Uᵀ (V − J v_h).
  void slide(const Vector6d& twist, const NearReference& near, VelocityBounds& bounds, Eigen::VectorXd& wanted) noexcept;

  const Robot& robot_;
  const ControllerSettings& settings_;
  const UsableLimits& usable_;
  KinematicState state_, ahead_;
  FrameJacobian jacobian_transposed_, projected_, jacobian_ahead_;
  Matrix6d principal_ = Matrix6d::Identity();  // directions of the Jacobian
  Vector6d squares_ = Vector6d::Zero();        // Squares of its singular values.
  Vector6d twist_ = Vector6d::Zero();
  Eigen::VectorXd best_v_, ahead_q_;
};

}  // namespace sidestep
