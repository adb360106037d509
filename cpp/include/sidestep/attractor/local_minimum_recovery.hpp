#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <random>

#include "sidestep/attractor/goal.hpp"
#include "sidestep/math/progress_monitor.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

struct LocalMinimumSettings {
  double patience = 0.6;   ///< Time without progress after which the arm counts as stuck [s].
  double fraction = 0.05;  ///< Fraction by which the goal potential (or the squared distance) falls in progress [-].
  double leg = 2.0;        ///< Longest time spent on the first sub-goal for a goal [s]; n times that on the n-th.
  /// Largest distance of each joint of the first sub-goal from the arm [rad | m]; n times that for the n-th.
  double spread = 1.7;
  std::uint64_t seed = 0;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<LocalMinimumSettings>>& fields();

/// Leads an arm out of local minima without a map: when it is stuck, it follows a random configuration for a while,
/// then its goal again, as the random walks of Barraquand and Latombe (1991) do for potential fields.
///
/// A spring on a complete metric comes to rest at every local minimum of its potential on the free set, so whether it arrives
/// depends on where it starts. A sub-goal gives it another start. The motion to a sub-goal is one of the same system, so
/// nothing about safety changes. Sub-goals are drawn uniformly around the arm, within its position limits. The first ones
/// are near, since most dead ends are shallow; the others need a long way out. An arm within 0.01 [rad | m] of its goal has
/// arrived and is not stuck. If the goal jumps by more than 0.2 [rad | m] from one call to the next, everything starts anew:
/// the patience and the sub-goals.
class LocalMinimumRecovery {
 public:
  explicit LocalMinimumRecovery(const Robot& robot, LocalMinimumSettings settings = {});

  /// The goal to follow in a step of `period` [s]: `goal` itself, or a sub-goal. q (nv) [rad | m] is the state.
  /// `potential`, that of the goal followed in the step before (GoalPotential::potential; NaN where there was none), serves
  /// for poses; of configurations the distance is known. No allocation.
  const Goal& pursue(const Goal& goal, ConstVectorRef q, double potential, double period) noexcept;

  /// Whether the last step followed a sub-goal.
  bool escaping() const noexcept { return escaping_; }
  /// How many sub-goals there have been.
  int count() const noexcept { return count_; }
  const LocalMinimumSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return static_cast<int>(lower_.size()); }

 private:
  bool is_elsewhere(const Goal& goal) noexcept;
  void turn(bool escape, ConstVectorRef q) noexcept;

  LocalMinimumSettings settings_;
  Eigen::VectorXd lower_, upper_;
  std::mt19937_64 random_;
  ProgressMonitor stuck_, halted_;  // Monitors of progress to the goal, and to a sub-goal.
  Goal sub_goal_;
  Eigen::VectorXd configuration_;  // Configuration or pose of the goal in the step before.
  Eigen::Isometry3d pose_ = Eigen::Isometry3d::Identity();
  bool was_pose_ = false;
  double time_ = 0.0, since_ = 0.0;
  double way_ = std::numeric_limits<double>::infinity();  // Distance to the goal in the step before.
  bool escaping_ = false;
  bool turned_ = true;  // Whether the potential of the step before is that of another goal.
  int count_ = 0;
  int tries_ = 0;  // Sub-goals for this goal so far: each is farther off than the one before.
};

}  // namespace sidestep
