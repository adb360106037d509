#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <variant>
#include <vector>

#include "sidestep/constraints/motion_program.hpp"
#include "sidestep/math/fields.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/planning/avoidance_trajectory.hpp"
#include "sidestep/robot/dynamics.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/attractor/goal.hpp"

namespace sidestep {

struct LookAheadSettings {
  double horizon = 2.0;      ///< Duration that is predicted [s].
  double period = 0.01;      ///< Time step of the predicted motions [s]; shortened so that `delay` is a multiple of it.
  double delay = 0.1;        ///< Time from one look to the next [s]; from then on its result is followed.
  double clearance = 0.004;  ///< Clearance from obstacles that a motion must keep [m].
  int tries = 500;           ///< Trajectories that one look draws.
  std::uint64_t seed = 0;
  // For a Controller whose look-ahead runs in a thread. With enough processor time a look is at most two delays and one wake-up old.
  double slow_after = 3.0;   ///< Age of a look from which the arm is slowed, in delays.
  double rest_after = 10.0;  ///< Age of a look at which the arm rests, in delays: 1 s, in which a person walks 1.6 m.

  /// Share of its speed that an arm may use among moving obstacles, with a look of this age [s]: 1 up to slow_after delays, then
  /// linear, to 0 at rest_after.
  double pace(double age) const noexcept;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};
template <>
const std::vector<Field<LookAheadSettings>>& fields();

/// Leads an arm out of the way of moving obstacles, in time. A barrier alone backs off along the line of approach until a joint
/// limit stops the arm, where a step aside would have let the obstacle pass.
///
/// A look predicts the motion of the system, with clearances and limits as a MotionProgram keeps them (by torque if the
/// dynamics are given), from where the arm will be when the look ends, with obstacles at constant velocity. If both the way to
/// the goal and the trajectory being followed come closer to an obstacle than `clearance`, it draws trajectories to random
/// configurations: near ones, far ones, and some close to the followed one. It filters them in three stages:
///   1. by how far their references get, without the program, before the body is deep in an obstacle: quick to compute;
///   2. by their least clearance in time steps of 0.05 s, as many trajectories as there is time for;
///   3. by that in time steps of `period`, best first, until one keeps `clearance`.
/// If none keeps it, the arm follows the one of the largest least clearance or, if all collide, the one that collides last. It
/// follows the goal again as soon as the way to the goal is free.
///
/// A trajectory is no motion of the system, whose barriers would push the arm off it. The MotionProgram, which is required,
/// keeps the arm off obstacles and itself, and within limits. If nothing moves, nothing is predicted. Towards a goal that
/// exerts no attraction, such as one outside the limits, the arm is predicted to come to rest, as it does.
///
/// `update` is for another thread than the loop's: it takes as long as some thousand steps. `pursue` does the same in
/// simulated time. One thread at a time.
class LookAhead {
 public:
  /// Function that advances a goal for a duration [s] while the arm is at q, v (nv), for example along a path. Empty: the goal
  /// advances by its own velocity (`advance`). Each predicted motion has a copy.
  using Leader = std::function<void(const Eigen::VectorXd& q, const Eigen::VectorXd& v, double duration, Goal& goal)>;

  /// Throws std::invalid_argument if there is no system, it has no clearances to obstacles, or a setting is at fault,
  /// which it names. `dynamics`: of an arm that is moved by torque; of the system's robot.
  explicit LookAhead(std::shared_ptr<const GeometricSystem> system, LookAheadSettings settings = {},
                     std::optional<RigidBodyDynamics> dynamics = std::nullopt);

  /// Looks ahead from the present q, v (nv) [rad | m, /s], obstacles and followed trajectory, if any. Returns the trajectory to
  /// follow from `delay` on; empty: the goal. It is empty if nothing moves or the state is unusable. Allocates.
  std::optional<AvoidanceTrajectory> update(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                            const Obstacles& obstacles,
                                            const std::optional<AvoidanceTrajectory>& followed = std::nullopt,
                                            const Leader& leader = {});

  /// The trajectory to follow in a step of `period` [s] of a simulation; null: the goal. Looks every `delay`, and follows the
  /// result of the look before.
  const AvoidanceTrajectory* pursue(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                    const Obstacles& obstacles, double period, const Leader& leader = {});
  /// Whether the next `pursue` looks.
  bool is_due(double period) const noexcept { return !(until_look_ > 0.5 * period); }
  /// Forgets all results, before another motion is pursued.
  void reset() noexcept;
  /// As if `pursue` had found a trajectory before. No allocation after the first time.
  void resume(const AvoidanceTrajectory& trajectory) { found_ = pursued_ = trajectory; }

  /// Sets a predicate that ends a look by an Interruption; earlier results stay.
  void interrupt_when(Interrupted interrupted) { interrupted_ = std::move(interrupted); }

  /// Number of trajectories found.
  int count() const noexcept { return count_; }
  const LookAheadSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return system_->robot().num_coordinates(); }

 private:
  /// An arm that follows a trajectory or, where it is empty, the system to a goal.
  struct Motion {
    Eigen::VectorXd q, v;
    Obstacles obstacles;
    Goal goal;
    Leader leader;
    std::optional<AvoidanceTrajectory> flight;
  };
  struct Tried {
    double clearance;
    AvoidanceTrajectory flight;
  };
  /// Integrator of motions, with time step `period` [s].
  struct Stepper {
    double period;
    MotionProgram program;  // Program of the arm; by torque if the dynamics are given.
    int steps = 0;          // Steps integrated so far.

    Stepper(const Robot& robot, double period, bool by_torque);
  };

  void check_interrupted() const;
  /// Advances by one period; returns the least clearance from obstacles at its begin [m].
  double advance(Motion& motion, Stepper& stepper);
  /// Least clearance [m] of a motion up to the horizon; ends at any that is at most `enough`. If it collides, the rest of the
  /// horizon is subtracted, at 1 m/s, so that later collisions rank higher.
  double least_clearance(Motion motion, Stepper& stepper, double enough);
  /// Random trajectories from a state, those first whose references get farthest before the body is deep in an
  /// obstacle.
  std::vector<AvoidanceTrajectory> draw_flights(const Motion& now, const std::optional<AvoidanceTrajectory>& followed);
  /// The trajectories from a state that keep farthest away in coarse steps, best first.
  std::vector<Tried> promising(const Motion& now, const std::optional<AvoidanceTrajectory>& followed);
  Eigen::VectorXd draw(const Eigen::VectorXd& q, double spread);

  std::shared_ptr<const GeometricSystem> system_;
  LookAheadSettings settings_;
  GeometricSystem::Workspace workspace_;
  int periods_;  // Periods of a delay.
  std::optional<RigidBodyDynamics> dynamics_;
  std::optional<RigidBodyDynamics::Workspace> dynamics_workspace_;
  Eigen::MatrixXd mass_;  // Mass matrix of the predicted state.
  Eigen::VectorXd bias_;
  Stepper fine_, coarse_;
  MotionSolution filtered_;
  std::vector<Eigen::Index> of_obstacles_;  // Coordinates of obstacles.
  std::mt19937_64 random_;
  std::optional<AvoidanceTrajectory> found_, pursued_;
  double until_look_ = 0.0;
  int count_ = 0;
  Interrupted interrupted_ = never_interrupted;
};

}  // namespace sidestep
