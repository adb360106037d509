#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "sidestep/control/acceleration_filter.hpp"
#include "sidestep/dynamical_system/geometric_system.hpp"
#include "sidestep/dynamical_system/goal.hpp"
#include "sidestep/obstacles/obstacles.hpp"

namespace sidestep {

struct EvasionSettings {
  double horizon = 2.0;      ///< [s] how far is looked ahead
  double period = 0.01;      ///< [s] of the steps of the motions looked at
  double delay = 0.1;        ///< [s] from one look to the next, from when on is followed what it found
  double clearance = 0.004;  ///< [m] that a motion has to keep from obstacles
  int tries = 20;            ///< sub-goals that are tried in one look, at most
  std::uint64_t seed = 0;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

/// Leads an arm out of the way of what moves, in time: a barrier yields straight away from it, until a joint is at its
/// limit or at its fastest, where a step aside would have let it pass.
///
/// In a look the system, with clearances and joint limits as an AccelerationFilter keeps them, is integrated from where
/// the arm will be when the look has ended, with the obstacles moving on as they do. If on its way to the goal, or to the
/// sub-goal that is followed already, that comes nearer to an obstacle than `clearance`, the same is done for random
/// configurations, near ones, far ones and such as are near the best, until one is found on whose way it does not. If
/// none is, that is followed on whose way the least clearance is largest. The goal is followed again as soon as its own
/// way is free. Every leg is a motion of the same system, so nothing about safety changes. Where nothing moves, nothing
/// is looked at.
///
/// Towards a goal that the system falls back from, such as one outside the limits, the arm is taken to stay where it is.
///
/// A look takes as long as some hundred steps for each motion: `look` is for another thread than the loop's. `pursue`
/// does the same in simulated time. One thread at a time.
class Evasion {
 public:
  /// Throws std::invalid_argument if there is no system, it has no clearances to obstacles, or a setting is at fault,
  /// which it names.
  explicit Evasion(std::shared_ptr<const GeometricSystem> system, EvasionSettings settings = {});

  /// Looks ahead from q, v (nv) [rad | m, /s], which are of now, as are the obstacles. Allocates. After it `following` is
  /// what is to be followed from `delay` on: `goal`, if nothing moves or the state is unusable.
  void look(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles);

  /// What the last look found: `goal` itself, or a sub-goal, until the next look.
  const Goal& following(const Goal& goal) const noexcept { return evading_ ? sub_goal_ : goal; }
  /// Whether that is a sub-goal, found or kept.
  bool evading() const noexcept { return evading_; }

  /// The goal to follow in a step of `period` [s] of a simulation: looks every `delay`, and follows what the look before
  /// found.
  const Goal& pursue(const Goal& goal, const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles,
                     double period);
  /// Whether the last step of `pursue` followed a sub-goal.
  bool pursuing() const noexcept { return pursuing_; }

  /// How many sub-goals were found.
  int count() const noexcept { return count_; }
  const EvasionSettings& settings() const noexcept { return settings_; }
  int num_coordinates() const noexcept { return system_->robot().num_coordinates(); }

 private:
  struct State {
    Eigen::VectorXd q, v;
    Goal goal;
    Obstacles obstacles;
  };
  /// Moves on by one period; the least clearance from obstacles at its beginning [m].
  double advance(State& state);
  /// The least clearance [m] on the way to a goal, or any of the way that is no more than `enough`.
  double least_clearance(const State& start, const Goal& goal, double enough);
  Goal draw(const Eigen::VectorXd& q, int number);

  std::shared_ptr<const GeometricSystem> system_;
  EvasionSettings settings_;
  GeometricSystem::Workspace workspace_;
  AccelerationFilter filter_;
  TorqueSolution filtered_;
  std::vector<Eigen::Index> of_obstacles_;  // coordinates
  std::mt19937_64 random_;
  Goal sub_goal_, pursued_;
  bool evading_ = false, pursuing_ = false;
  double until_look_ = 0.0;
  int count_ = 0;
};

}  // namespace sidestep
