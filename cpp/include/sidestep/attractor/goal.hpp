#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "sidestep/math/rotation.hpp"
#include "sidestep/attractor/gain.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

// A goal is a potential U(q, t) over the joints. Its gradient takes the place of K (q − q*) in the damped spring,
//
//     h = −G⁻¹ (∂U/∂q − a*) − D (v − v*),
//
// v* is the joint velocity that follows a moving goal, a* its rate: with them a moving goal is followed without lag. Goals
// are values, made anew or advanced as they move.

/// A configuration: U = ½ (q − q*)ᵀ K (q − q*), with the system's own stiffness K; v* = dq*/dt, a* = dv*/dt.
struct JointGoal {
  explicit JointGoal(Eigen::VectorXd position);
  JointGoal(Eigen::VectorXd position, Eigen::VectorXd velocity);
  /// Throws std::invalid_argument on different sizes.
  JointGoal(Eigen::VectorXd position, Eigen::VectorXd velocity, Eigen::VectorXd acceleration);

  Eigen::VectorXd position;      ///< Position q* (nv) [rad | m].
  Eigen::VectorXd velocity;      ///< Velocity dq*/dt (nv) [rad/s | m/s].
  Eigen::VectorXd acceleration;  ///< Acceleration d²q*/dt² (nv) [rad/s² | m/s²].
};

struct PoseGoalSettings {
  bool position_only = false;          ///< Whether the orientation is free.
  double position_stiffness = 4.0;     ///< Stiffness k_p [1/(m s)²], so that J'J k_p is a stiffness of the joints [1/s²].
  double orientation_stiffness = 0.5;  ///< Stiffness k_R [1/s²].
  Eigen::VectorXd rest;                ///< Posture q_rest (nv) that attracts the free joints; empty: none.
  double posture_stiffness = 0.0;      ///< Stiffness k_0 of that attraction [1/s²].
};

/// A pose of a frame, in the world. With p, R the frame's and φ = log(R*ᵀ R) the rotation vector between them,
///
///     U = ½ k_p |p − p*|² + ½ k_R |φ|²,     ∂U/∂q = k_p J_pᵀ (p − p*) + k_R J_ωᵀ R φ.
///
/// Why no Jacobian of the logarithm is left: dφ/dt = J_r(φ)⁻¹ ω with ω = Rᵀ J_ω v the angular velocity in the frame and
/// J_r the right Jacobian of SO(3). φ is the axis of its own rotation, so J_r(φ)ᵀ φ = φ, and dU/dt = k_R φ·ω exactly.
///
/// Near |φ| = π, a half turn, U has a ridge: both ways back are equally short. The gradient stays finite there, |R φ|
/// <= π, and on the ridge one of the two ways is taken; as U falls on both sides, the motion leaves the ridge.
///
/// The posture acts in the null space of the pose: N k_0 (q − q_rest) is added to ∂U, with N = I − Jᵀ (J Jᵀ + λ² I)⁻¹ J and J
/// the Jacobian of what the goal prescribes. It is no gradient, but moves the resting pose by at most λ²/σ² of itself, σ the
/// smallest singular value of J. The joint velocity that follows a twist V* of the pose is v* = Jᵀ (J Jᵀ + λ² I)⁻¹ V*.
struct PoseGoal {
  /// Throws std::invalid_argument on a frame that is unknown or that no joint moves (listing the allowed ones), on a
  /// rotation that is none, and on settings out of range. Values that are not finite give a status in the loop instead.
  PoseGoal(const Robot& robot, const std::string& frame, const Eigen::Isometry3d& pose, PoseGoalSettings settings = {},
           const Vector6d& twist = Vector6d::Zero());

  /// Adds a pose that another frame is to have at the same time, as of a second arm: U and v* are summed, and rest and posture
  /// stiffness of `other` do not count. Throws std::invalid_argument on a goal of another robot and a frame that has one.
  PoseGoal& add(PoseGoal other);

  Eigen::Isometry3d pose;  ///< Pose X_WF* in the world.
  Vector6d twist;          ///< Its motion in the world: velocity of the origin [m/s], angular velocity [rad/s].
  PoseGoalSettings settings;
  std::vector<PoseGoal> others;  ///< Further goals, see `add`; these have no others of their own.

  /// Data of the robot that a goal was made for: enough to make it again without the robot.
  struct MadeFor {
    Frame frame;
    std::uint64_t joints_hash = 0;
    double reach = 0.0;
    Eigen::Vector3d shoulder = Eigen::Vector3d::Zero();
  };
  /// A goal again, of parts that another one had; they are not checked.
  PoseGoal(MadeFor made_for, const Eigen::Isometry3d& pose, PoseGoalSettings settings, const Vector6d& twist);
  const MadeFor& made_for() const noexcept { return made_for_; }

  const Frame& frame() const noexcept { return made_for_.frame; }
  /// Whether it was made for a robot with these joints.
  bool is_for(const Robot& robot) const noexcept { return made_for_.joints_hash == robot.joints_hash(); }
  /// Largest distance of the frame from `shoulder` [m]: the sum of the lengths between its joints.
  double reach() const noexcept { return made_for_.reach; }
  /// The origin of the first joint that moves the frame, in the world [m].
  const Eigen::Vector3d& shoulder() const noexcept { return made_for_.shoulder; }

 private:
  MadeFor made_for_;
};

/// The frame of a name. Throws std::invalid_argument, beginning with `what`, where it is unknown or no joint moves it, with
/// the names that are allowed.
const Frame& moved_frame(const Robot& robot, const std::string& name, const std::string& what);

using Goal = std::variant<JointGoal, PoseGoal>;

/// Moves a goal for `duration` [s] as its velocity and acceleration say. False where that gives what is not finite:
/// then it stays where it is. No allocation.
bool advance(Goal& goal, double duration) noexcept;
bool advance(PoseGoal& goal, double duration) noexcept;

/// Whether a goal has a velocity or an acceleration.
bool is_moving(const Goal& goal) noexcept;

/// @cond internal
/// What is wrong with a goal.
enum class GoalFault {
  none,
  invalid,         ///< Not finite, or made for another robot.
  outside_limits,  ///< A configuration outside the position limits, by more than rounding (1e-9).
  out_of_reach,    ///< A position that the frame cannot reach in any configuration; the equations still hold.
};
GoalFault check(const Goal& goal, const Robot& robot) noexcept;
/// @endcond

/// Potential of a goal at a state, its gradient, and the distance to the goal. Made once, updated in every step.
struct GoalPotential {
  explicit GoalPotential(int nv);

  /// Computes everything; not for a goal with a fault that makes it unusable. No allocation.
  void update(const Goal& goal, const KinematicState& state, const Gain& stiffness) noexcept;

  /// No goal: the gradient is zero, and damping brings the arm to rest where it is. No allocation.
  void release() noexcept;

  double potential = 0.0;    ///< U, without the posture.
  Eigen::VectorXd gradient;  ///< Gradient ∂U/∂q − a* (nv), posture included.
  Eigen::VectorXd velocity;  ///< Desired velocity v* (nv).
  // Distance to the goal, of its farthest frame; NaN if the goal has no such part.
  double joint_error = nan;     ///< Largest |q − q*| [rad | m].
  double position_error = nan;  ///< Distance |p − p*| [m].
  double rotation_error = nan;  ///< Angle |φ| [rad], at most π.

  /// The coordinate that `joint_error` belongs to; -1 where the goal is no configuration.
  int farthest_coordinate() const noexcept;

 private:
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  void update(const JointGoal& goal, const KinematicState& state, const Gain& stiffness) noexcept;
  void update(const PoseGoal& goal, const KinematicState& state) noexcept;
  void add(const PoseGoal& goal, bool has_posture, const KinematicState& state) noexcept;

  Eigen::VectorXd displacement_;
  Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian_transposed_;
};

/// The rotation vector φ of a rotation matrix, |φ| <= π. Finite for every rotation; at a half turn one of ±φ.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) noexcept;

}  // namespace sidestep
