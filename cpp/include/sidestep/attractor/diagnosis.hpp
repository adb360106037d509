#pragma once

#include <limits>
#include <string>

#include "sidestep/attractor/embedding.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// @cond internal
/// State of the motion, from one step.
enum class MotionState {
  free,             ///< Moving, with nothing in the way.
  sliding,          ///< Moving, deflected by a barrier.
  arriving,         ///< Within the tolerances of the goal.
  stuck,            ///< At rest short of the goal: a local minimum, or a pose out of reach.
  blocked_at_goal,  ///< Stuck, and the goal itself is inside a barrier.
  inside_barrier,   ///< A clearance is below its floor: moving out.
  fallback,         ///< The step is a fallback; nothing is known.
};

/// Short names, for example "blocked_at_goal".
const char* name(MotionState state) noexcept;
/// @endcond

/// Thresholds, the same for every robot and scene.
namespace judgement {
constexpr double arrived_joint = 0.05;     // Largest joint error at the goal [rad | m], as everywhere in this project.
constexpr double arrived_position = 0.01;  // Largest position error at the goal [m].
constexpr double arrived_rotation = 0.05;  // Largest rotation error at the goal [rad].
constexpr double slow = 0.02;              // Speed |v| below which an arm counts as at rest [rad/s].
constexpr double held = 0.05;              // Share of the goal's acceleration that is left where an arm counts as stuck [-].
// Desired acceleration |∂U| that counts as none [rad/s²]: a tenth of that of K = 0.5 at arrived_joint.
constexpr double vanished = 0.0025;
constexpr double noticed = 0.05;  // Blocked share of the desired acceleration from which the arm counts as sliding [-].
}  // namespace judgement

/// Explanation of a motion, from one step alone.
///
/// The goal desires the acceleration −∂U; the metric lets −G⁻¹ ∂U through and holds back
///
///     b = ∂U − G⁻¹ ∂U = JᵀJ G⁻¹ ∂U = Σ_k b_k,      b_k = J_k (J_k · G⁻¹ ∂U),
///
/// an exact sum over the coordinates. The share of coordinate k is b_k·b / |b|², and the largest share dominates.
///
/// Stuck means: the speed is below `slow`, the goal is not reached, and |G⁻¹ ∂U| < held |∂U|. Nearly all of the desired
/// acceleration is then along gradients of active barriers, and no direction is left to follow it: a local minimum. A ∂U that
/// vanishes short of the goal (a pose out of reach, a singular posture) is one as well, with no coordinate to blame. An arm
/// that creeps faster than `slow` without progress is found over time, see ProgressMonitor.
struct Diagnosis {
  MotionState state = MotionState::fallback;
  int coordinate = -1;  ///< Dominating embedding coordinate, see GeometricSystem::labels; -1: none.
  int point = -1;       ///< Its nearest obstacle point; -1: none.
  double clearance = std::numeric_limits<double>::infinity();  ///< Its clearance [m | rad], where it has one.
  double share = 0.0;    ///< Its share of what is held back; of several opposed ones it can exceed 1.
  double blocked = 0.0;  ///< Share of the desired acceleration that is held back, 1 − |G⁻¹ ∂U| / |∂U| [-].
  double speed = 0.0;    ///< Speed |v| [rad/s].
  // How far the goal is, as in GoalPotential; NaN where it has no such part.
  double joint_error = nan, position_error = nan, rotation_error = nan;
  bool prismatic = false;  ///< Whether the joint of `joint_error` is prismatic, so that the error is in m.

  /// Distance to the goal in words, for example "0.31 rad", "12.0 mm" or "12.0 mm and 0.31 rad".
  std::string way_left() const;
  /// Whether that distance counts as arrived.
  bool is_near() const noexcept;

  /// In one English sentence, given the label of the dominating coordinate and, for their names, the obstacles of the
  /// step.
  std::string describe(const CoordinateLabel& label, const Obstacles& obstacles = Obstacles::none()) const;

 private:
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace sidestep
